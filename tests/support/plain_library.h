#pragma once

namespace glint::test {

/// The plainest traversal library, tests/support/plain_library.glsl: every ray is held against every primitive. It is
/// made known to the shader compiler by the name that this returns, which is for `TracingRewrite::library`.
const char* plainLibrary();

}  // namespace glint::test
