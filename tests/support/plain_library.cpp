#include "support/plain_library.h"

#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>
#include <glint/shader/shader_compiler.h>

namespace glint::test {

const char* plainLibrary() {
    static constexpr const char* name = "test/plain_library.glsl";
    static const Expected<std::string> text = readTextFile(testsDir() / "support/plain_library.glsl");
    EXPECT_THAT(text, IsOk());
    if (text) setShaderInclude(name, *text);
    return name;
}

}  // namespace glint::test
