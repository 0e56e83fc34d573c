#pragma once

// Examples run as programs of their own, and what they cost.

#include "bench/bench.h"

#include <string>
#include <string_view>

namespace glint::bench {

struct ExampleRun {
    double wall = 0.0;       ///< seconds from its start to its end
    double processor = 0.0;  ///< seconds that its threads were on processors
    double trace_ms = 0.0;   ///< milliseconds of its fastest first pass, by the device's clock
};

/// Runs one of the examples of this build to its end; `environment` as a shell has it ("NAME=value NAME=value"). Throws
/// if it has not been built or fails.
ExampleRun runExample(std::string_view name, const std::string& arguments, const std::string& environment = {});

/// A device on which Traversals are the driver's pipelines, as an example has with "--tracing driver"; it may have no
/// ray queries. A null handle if the driver has no pipelines. Joined ones have "--tracing software".
Device createPipelineDevice();

}  // namespace glint::bench
