#pragma once

#include "08_hello_dynamic/models.h"
#include "common/example.h"

#include <functional>

/// Measures what it costs to follow models that are deformed more and more, by refitting structures that were built at
/// rest (for fast tracing) and by building them anew (fast) each time: with builds in a recorded list, and with those
/// of the device. Prints a table of both and where the sums of building and tracing cross, and notes them in the
/// statistics: columns `crossover.*`, in milliseconds; `crossover.recorded` and `crossover.queued` are the deformation
/// from which on rebuilding is cheaper, null if it never is.
///
/// `trace` records the tracing of the structures' top level. Times are the host's, from the submission to the end.
glint::Status measureCrossover(Example& example, glint::Device& device, const Models& models,
                               const std::function<void(glint::Compute&, const Structures&)>& trace);
