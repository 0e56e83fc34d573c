#pragma once

#include <filesystem>
#include <string_view>

namespace glint::test {

/// A new folder of its own, removed with everything in it at the end of the scope.
class TempDir {
public:
    TempDir();
    ~TempDir();
    TempDir(const TempDir&) = delete;
    TempDir& operator=(const TempDir&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

private:
    std::filesystem::path path_;
};

/// Where tests leave what a person may want to look at: out/test in the source tree, or $GLINT_TEST_OUTPUT. Made if
/// absent.
std::filesystem::path outputDir();

/// tests/ in the source tree.
std::filesystem::path testsDir();

/// The Stanford bunny of Debian's package glmark2-data (69,666 triangles); empty if the package is not installed.
std::filesystem::path bunnyPath();

/// A file of Debian's package assimp-testmodels, named as below its folder `models`; empty if it is not installed.
std::filesystem::path assimpModelPath(std::string_view name);

/// At the beginning of a test: skips it where the package is not installed.
#define GLINT_NEED_ASSIMP_MODELS()                             \
    if (::glint::test::assimpModelPath("OBJ/box.obj").empty()) \
    GTEST_SKIP() << "needs the models of Debian's package assimp-testmodels"

/// At the beginning of a test: skips it where the bunny is not installed.
#define GLINT_NEED_BUNNY() \
    if (::glint::test::bunnyPath().empty()) GTEST_SKIP() << "needs the Stanford bunny (Debian's package glmark2-data)"

}  // namespace glint::test
