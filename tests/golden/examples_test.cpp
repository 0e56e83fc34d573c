// The examples' pictures at small sizes against the stored ones, run as programs, with the validation layers on.

#include "golden/render.h"
#include "support/gltf_builder.h"
#include "support/image_compare.h"

#include <glint/base/file.h>
#include <glint/format/image.h>
#include <glint/format/splats.h>
#include <glint/geometry/mesh_splats.h>
#include <glint/geometry/primitives.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>

namespace glint::test {

Expected<Image> renderExample(const std::string& program, const std::string& arguments, const TempDir& folder) {
    const std::filesystem::path picture = folder / "picture.png";
    const std::filesystem::path messages = folder / "messages.txt";
    const std::string command = "GLINT_VALIDATION=1 '" GLINT_EXAMPLES "/" + program + "' --image '" + picture.string() +
                                "' " + arguments + " > /dev/null 2> '" + messages.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    const Expected<std::string> text = readTextFile(messages);
    EXPECT_TRUE(text && text->empty()) << command << "\n" << (text ? *text : "");
    return Image::load(picture);
}

namespace {

void expectGolden(const std::string& program, const std::string& arguments, const std::string& name,
                  const ImageTolerance& tolerance) {
    const TempDir folder;
    const Expected<Image> image = renderExample(program, arguments, folder);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_TRUE(matchesGolden(*image, name, tolerance));
}

}  // namespace

// A pixel whose centre lies on an edge, or that two rasterisers round differently, may flip: 1 of 8 along the outline
// of about 3 * 80 pixels.
TEST(Golden, Triangle) { expectGolden("00_hello_triangle", "--size 128x72", "00_hello_triangle", {.texels = 30}); }

TEST(Golden, TriangleTurned) {
    expectGolden("00_hello_triangle", "--size 128x72 --time 0.5", "00_hello_triangle_turned", {.texels = 30});
}

// Four samples a pixel: where an edge moves by a part of 256, one of them falls to its other side, in a pixel of fifty;
// and levels of textures differ by their filters' 8 bits. One pixel in a hundred may.
TEST(Golden, Koi) {
    expectGolden("01_hello_usdz", "--size 160x90 --time 3", "01_hello_usdz", {.texels = 144});
    expectGolden("01_hello_usdz", "--size 160x90 --time 5.25", "01_hello_usdz_later", {.texels = 144});
}

// Particles blend from the farthest to the nearest, in half floats: each layer rounds by at most 2^-11 of the sum and
// hides its share of the errors behind it, so that tens of layers stay below 1 of 255; where devices round positions
// differently, edges of particles fall to other pixels, for which one in a hundred is allowed.
TEST(Golden, Particles) {
    expectGolden("02_hello_compute", "--size 160x90 --time 2", "02_hello_compute",
                 {.channel = 2.5f / 255.0f, .texels = 144});
}

// Both forms draw the same clusters with the same positions: interpolation may round differently. With a colour for
// each instance it is the picture that rays make of the full mesh, but that shading follows normals of fewer vertices,
// which an error in pixels says nothing about (an eighth is allowed), and that edges move by up to one pixel: three in
// a hundred pixels are at edges that show.
TEST(Golden, LevelsOfDetail) {
    const TempDir folder;
    const std::string at = "--size 160x90 --time 3";
    const Expected<Image> mesh = renderExample("03_hello_mesh", at, folder);
    const Expected<Image> compute = renderExample("03_hello_mesh", at + " --compute --instance-colors", folder);
    ASSERT_TRUE(mesh && compute);
    EXPECT_TRUE(matchesGolden(*mesh, "03_hello_mesh", {.texels = 144}));
    EXPECT_TRUE(matchesGolden(*compute, "05_hello_tracing", {.channel = 32.0f / 255.0f, .texels = 720}));
    // Left of the bar, which is at half the width, colours are the same.
    uint32_t differing = 0;
    for (uint32_t y = 0; y < 90; y++)
        for (uint32_t x = 0; x < 80; x++)
            for (int i = 0; i < 3; i++) differing += std::abs(mesh->load(x, y)[i] - compute->load(x, y)[i]) > 0.01f;
    EXPECT_LE(differing, 3u);
}

// The same clusters, rasterised by the same rules: the picture of 03. Pixels whose centres are within 2^-8 of an edge
// may differ, and barycentrics from one division round differently: by less than the step that is allowed anyway.
TEST(Golden, RasterisedTori) {
    expectGolden("04_hello_raster", "--size 160x90 --time 3", "03_hello_mesh", {.texels = 144});
}

// Rays that graze an edge fall to either side: the float64 rendering finds that of one to two pixels in a hundred.
TEST(Golden, TracedTori) {
    expectGolden("05_hello_tracing", "--size 160x90 --time 3", "05_hello_tracing", {.texels = 400});
}

// Besides: the edges of shadows, and of models seen through others' holes. Either way of keeping the structures up to
// date gives the same picture.
TEST(Golden, DeformedTori) {
    for (const char* mode : {"refit", "rebuild"})
        expectGolden("08_hello_dynamic", std::string("--size 160x90 --time 3 --mode ") + mode, "08_hello_dynamic",
                     {.texels = 400});
}

// Besides edges, those of shadows and of what the models mirror. The two forms have the same shading: they differ where
// the driver's and Glint's triangle tests put a ray on other sides of an edge, which are rounding apart.
TEST(Golden, TraversedTori) {
    const TempDir folder;
    const std::string at = "--size 160x90 --time 3";
    const Expected<Image> pipeline = renderExample("06_hello_traversal", at + " --tracing driver", folder);
    const Expected<Image> query = renderExample("06_hello_traversal", at + " --query", folder);
    const Expected<Image> primary = renderExample("06_hello_traversal", at + " --primary --tracing driver", folder);
    const Expected<Image> primary_query = renderExample("06_hello_traversal", at + " --primary --query", folder);
    ASSERT_TRUE(pipeline && query && primary && primary_query);
    EXPECT_TRUE(matchesGolden(*pipeline, "06_hello_traversal", {.texels = 400}));
    EXPECT_TRUE(imagesMatch(*query, *pipeline, "06_hello_traversal_query", {.texels = 72}));
    // Devices whose traces do not nest get this.
    EXPECT_TRUE(imagesMatch(*primary_query, *primary, "06_hello_traversal_primary", {.texels = 72}));
    EXPECT_GT(compareImages(*primary, *pipeline, 0.02f).differing, 7200u);
}

// Sums of alphas and colours in float32, rounded to float16 and to 8 bits: a step. Besides, the rays that lit the
// splats may graze an edge: then a splat is lighter or darker, and the few pixels around it.
TEST(Golden, Splats) {
    const TempDir folder;
    const std::string at = "--size 160x90 --count 12000";
    const Expected<Image> image = renderExample("07_hello_splatting", at, folder);
    const Expected<Image> plain = renderExample("07_hello_splatting", at + " --plain", folder);
    const Expected<Image> flat = renderExample("07_hello_splatting", at + " --degree 0", folder);
    ASSERT_TRUE(image && plain && flat);
    EXPECT_TRUE(matchesGolden(*image, "07_hello_splatting", {.texels = 144}));
    // What the two methods leave out is less than 1/255 of a splat at a pixel, and few splats are at any.
    EXPECT_TRUE(imagesMatch(*plain, *image, "07_hello_splatting_plain", {.channel = 3.5f / 255.0f, .texels = 144}));
    // Highlights need more than one harmonic.
    EXPECT_GT(compareImages(*flat, *image, 0.02f).differing, 1440u);
}

// Files of a ball each, in the order in which they are named: red on the right, as seen from the diagonal, green on the
// left.
TEST(Golden, SplatsOfFiles) {
    const TempDir folder;
    const char* names[] = {"red.ply", "green.spz"};
    const Vector3f colors[] = {{0.8f, 0.1f, 0.1f}, {0.1f, 0.7f, 0.1f}};
    for (int i = 0; i < 2; i++) {
        MeshSplatsOptions options;
        options.count = 1000;
        options.degree = 0;
        options.color = [&](const Vector3f&) { return colors[i]; };
        // Of any size, anywhere.
        Mesh mesh = createSphere(30.0f, 3);
        for (Vector3f& position : mesh.positions) position.x += 1000.0f * static_cast<float>(i);
        const Expected<Splats> splats = splatsFromMesh(mesh, options);
        ASSERT_TRUE(splats && splats->save(folder / names[i]));
    }
    const std::string path = folder.path().string();
    const Expected<Image> image = renderExample(
        "07_hello_splatting", "--size 96x54 --fov 60 --splats '" + path + "/red.ply' --splats '" + path + "/green.spz'",
        folder);
    ASSERT_TRUE(image);
    uint32_t left = 0, right = 0;
    for (uint32_t y = 0; y < image->height(); y++) {
        for (uint32_t x = 0; x < image->width(); x++) {
            const Vector4f color = image->load(x, y);
            const bool is_red = color.x > 1.5f * color.y, is_green = color.y > 1.5f * color.x;
            (x < 48 ? left : right) += x < 48 ? is_green : is_red;
            EXPECT_FALSE(x < 40 ? is_red : x >= 56 && is_green) << x << " " << y;
        }
    }
    EXPECT_GT(left, 100u);
    EXPECT_GT(right, 100u);
}

// The course: pixels of edges and of shadows' edges, a tenth of which float64 finds on either side
// (course_reference_test.cpp has all of them one by one). engines_test.cpp has the pipelines that Glint joins.
TEST(Golden, Course) {
    for (const char* name : {"20_normals", "21_diffuse", "22_phong", "23_shadows", "24_reflections"})
        for (const char* form : {" --tracing driver", " --query"})
            expectGolden(name, std::string("--size 160x90") + form, name, {.texels = 15});
}

// A white square whose mask is cut out on one half, and a blue one as large right below it.
TEST(Golden, BindlessMasks) {
    const TempDir folder;
    std::vector<std::byte> texels(8 * 8 * 4, std::byte(255));
    for (size_t i = 0; i < 64; i++)
        if (i % 8 < 4) texels[i * 4 + 3] = std::byte(0);
    const Expected<Image> mask = Image::create(FormatRGBAu8n, 8, 8, texels);
    ASSERT_TRUE(mask && mask->save(folder / "mask.png"));
    const auto render = [&](const nlohmann::json& alpha) {
        GltfBuilder gltf;
        gltf.json["images"] = {{{"uri", "mask.png"}}};
        gltf.json["textures"] = {{{"source", 0}}};
        nlohmann::json white = {
            {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}}}};
        white.update(alpha);
        gltf.json["materials"] = {
            white, {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 1, 1}}, {"metallicFactor", 0}}}}};
        const int places = gltf.accessor(std::vector<float>{0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1}, "VEC2");
        for (int i = 0; i < 2; i++) {
            const float y = i == 0 ? 0.01f : 0.0f;
            const std::vector<float> square = {-1, y, -1, 1, y, -1, 1, y, 1, -1, y, -1, 1, y, 1, -1, y, 1};
            const int mesh = gltf.mesh(square, {{"material", i}, {"attributes", {{"TEXCOORD_0", places}}}});
            gltf.node({{"mesh", mesh}});
        }
        EXPECT_TRUE(writeTextFile(folder / "masks.gltf", gltf.text()));
        const Expected<Image> image = renderExample(
            "11_hello_bindless", "--size 96x54 --scene '" + (folder / "masks.gltf").string() + "'", folder);
        EXPECT_TRUE(image) << image.error().text();
        std::pair<int, int> count;  // white and blue pixels
        for (size_t i = 0; image && i < image->bytes().size(); i += 4) {
            const auto red = static_cast<int>(image->bytes()[i]), blue = static_cast<int>(image->bytes()[i + 2]);
            if (red > 100) count.first++;  // the sky has 63
            if (blue > red + 60) count.second++;
        }
        return count;
    };
    const auto [whole, hidden] = render(nlohmann::json::object());
    EXPECT_GT(whole, 300);
    const auto [half, seen] = render({{"alphaMode", "MASK"}});
    // What stays is the half next to the camera, which is seen twice as large; edges are a few pixels.
    EXPECT_NEAR(half, 2 * whole / 3, whole / 10);
    EXPECT_NEAR(half + seen, whole + hidden, whole / 20);
    EXPECT_LT(hidden, whole / 20);
    // All of it is below the cutoff, or nothing.
    EXPECT_EQ(render({{"alphaMode", "MASK"}, {"alphaCutoff", 1.5}}).first, 0);
    EXPECT_EQ(render({{"alphaMode", "MASK"}, {"alphaCutoff", 0}}).first, whole);
}

// Rays that graze an edge fall to either side, and devices filter textures with 8 bits of the place between texels,
// which normals make larger: one pixel in a hundred may differ.
TEST(Golden, Bindless) {
    expectGolden("11_hello_bindless", "--size 160x90 --time 3", "11_hello_bindless", {.texels = 144});
    expectGolden("11_hello_bindless", "--size 160x90 --time 3 --primary", "11_hello_bindless_primary", {.texels = 144});
}

// A mesh of a file, and the fragment form.
TEST(Golden, TracedBunny) {
    GLINT_NEED_BUNNY();
    const std::string mesh = "--size 160x90 --single --time 3 --fragment --mesh '" + bunnyPath().string() + "'";
    expectGolden("05_hello_tracing", mesh, "05_hello_tracing_bunny", {.texels = 72});
}

}  // namespace glint::test
