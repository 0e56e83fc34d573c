// Meshes that are wrong in the examples that draw levels of detail: by mesh shaders, by indirect draws and in compute
// they make one picture, or are refused with a reason.

#include "golden/render.h"
#include "support/bad_meshes.h"
#include "support/image_compare.h"

#include <glint/base/file.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <vector>

namespace glint::test {

namespace {

constexpr const char* ways[][2] = {{"03_hello_mesh", ""}, {"03_hello_mesh", " --compute"}, {"04_hello_raster", ""}};

}  // namespace

TEST(BadMeshes, AreDrawnByExamplesOrRefused) {
    const std::set<std::string> tried = {"one point", "a line", "one triangle many times", "not manifold", "a soup"};
    const TempDir folder;
    for (const BadMesh& bad : badMeshes()) {
        if (!tried.count(bad.name)) continue;
        SCOPED_TRACE(bad.name);
        const std::filesystem::path path = folder / "bad.ply";
        ASSERT_TRUE(bad.mesh.save(path));
        std::vector<Image> images;
        for (const auto& [program, arguments] : ways) {
            const std::string command =
                fmt::format("--mesh '{}' --single --size 160x90 --pixels 0{}", path.string(), arguments);
            if (bad.no_graph.empty()) {
                const Expected<Image> image = renderExample(program, command, folder);
                ASSERT_TRUE(image) << image.error().text();
                images.push_back(*image);
                continue;
            }
            const std::filesystem::path errors = folder / "errors";
            EXPECT_NE(std::system(fmt::format("'{}/{}' {} > '{}' 2> '{}'", GLINT_EXAMPLES, program, command,
                                              (folder / "output").string(), errors.string())
                                      .c_str()),
                      0);
            EXPECT_NE(readTextFile(errors)->find("[" + bad.no_graph + "]"), std::string::npos);
        }
        if (images.empty()) continue;
        size_t drawn = 0;
        for (uint32_t i = 0; i < 160 * 90; i++) drawn += images[0].load(i % 160, i / 160) != images[0].load(0, 0);
        if (bad.name != "a line") { EXPECT_GT(drawn, 200u); }
        // An edge passes within 2^-8 pixel of a pixel's centre, and may fall to either side, once in 128 pixels of its
        // length: of edges that are seen there are some 2,000 pixels.
        for (size_t way = 1; way < images.size(); way++)
            EXPECT_TRUE(imagesMatch(images[way], images[0], fmt::format("bad_mesh_{}", way), {.texels = 16}));
    }
}

}  // namespace glint::test
