#pragma once

#include "support/files.h"

#include <glint/base/expected.h>
#include <glint/format/image.h>

#include <string>

namespace glint::test {

/// Runs an example as a program, with the validation layers on, and returns its picture. Any message on stderr is a
/// failure: the layers speak there.
Expected<Image> renderExample(const std::string& program, const std::string& arguments, const TempDir& folder);

}  // namespace glint::test
