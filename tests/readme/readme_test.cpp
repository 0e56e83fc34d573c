// Runs the README's program, with the README's shader, as printed.

#include "support/files.h"

#include <glint/base/file.h>
#include <glint/format/image.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

namespace glint::test {

TEST(Readme, ProgramRendersAMesh) {
    const TempDir folder;
    // A tetrahedron: each face it shows has a shade of its own.
    ASSERT_TRUE(writeTextFile(folder / "mesh.obj", "v 0 1 0\nv -1 -1 1\nv 1 -1 1\nv 0 -1 -1\n"
                                                   "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"));
    const std::filesystem::path mesh = bunnyPath().empty() ? folder / "mesh.obj" : bunnyPath();
    const std::filesystem::path picture = folder / "picture.png";
    const std::string command =
        "cd '" README_FOLDER "' && '" README_PROGRAM "' '" + mesh.string() + "' '" + picture.string() + "'";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;

    const Expected<Image> image = Image::load(picture);
    ASSERT_TRUE(image) << image.error().text();
    ASSERT_EQ(image->width(), 512u);
    ASSERT_EQ(image->height(), 512u);
    uint32_t background = 0;
    std::set<long> shades;
    for (uint32_t y = 0; y < 512; y++)
        for (uint32_t x = 0; x < 512; x++) {
            const long shade = std::lround(image->load(x, y).x * 255.0f);
            background += shade == 64;
            shades.insert(shade);
        }
    // The mesh covers part of the picture, and is shaded.
    EXPECT_GT(background, 512u * 512u / 10);
    EXPECT_LT(background, 512u * 512u * 9 / 10);
    EXPECT_GE(shades.size(), 3u);
}

TEST(Readme, ProgramSaysWhatIsWrong) {
    const TempDir folder;
    const std::string output = (folder / "output.txt").string();
    const std::string command =
        "cd '" README_FOLDER "' && '" README_PROGRAM "' no_such_file.obj x.png > '" + output + "'";
    EXPECT_NE(std::system(command.c_str()), 0);
    const Expected<std::string> text = readTextFile(output);
    ASSERT_TRUE(text);
    EXPECT_NE(text->find("no_such_file.obj"), std::string::npos) << *text;
    EXPECT_NE(text->find("[file.open]"), std::string::npos) << *text;
}

}  // namespace glint::test
