#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>

#include <fstream>
#include <thread>

using namespace glint;
using namespace glint::test;

TEST(File, RoundTrip) {
    const TempDir dir;
    const std::string text("first\0second\n", 13);
    ASSERT_THAT(writeTextFile(dir / "a.txt", text), IsOk());
    const Expected<std::string> read = readTextFile(dir / "a.txt");
    ASSERT_THAT(read, IsOk());
    EXPECT_EQ(*read, text);
    const Expected<std::vector<std::byte>> bytes = readFile(dir / "a.txt");
    ASSERT_THAT(bytes, IsOk());
    EXPECT_EQ(bytes->size(), 13u);
}

TEST(File, EmptyFile) {
    const TempDir dir;
    ASSERT_THAT(writeFile(dir / "empty", {}), IsOk());
    const Expected<std::vector<std::byte>> bytes = readFile(dir / "empty");
    ASSERT_THAT(bytes, IsOk());
    EXPECT_TRUE(bytes->empty());
}

TEST(File, MissingNamesThePath) {
    const TempDir dir;
    const Expected<std::string> read = readTextFile(dir / "nothing");
    EXPECT_THAT(read, HasErrorId("file.open"));
    EXPECT_NE(read.error().message().find("nothing"), std::string::npos);
    EXPECT_EQ(read.error().code(), ErrorCode::Io);
}

TEST(File, FolderIsNoFile) {
    const TempDir dir;
    EXPECT_THAT(readFile(dir.path()), HasErrorId("file.open"));
    EXPECT_THAT(writeTextFile(dir.path(), "text"), HasErrorId("file.write"));
}

TEST(File, LimitIsInclusive) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a", "12345"), IsOk());
    EXPECT_THAT(readTextFile(dir / "a", 5), IsOk());
    EXPECT_THAT(readTextFile(dir / "a", 4), HasErrorId("file.too_large"));
}

TEST(File, DeviceWithoutSizeIsAnError) { EXPECT_THAT(readFile("/dev/zero", 1000), HasErrorId("file.read")); }

TEST(File, MissingFolderIsAnError) {
    const TempDir dir;
    EXPECT_THAT(writeTextFile(dir / "absent/a.txt", "text"), HasErrorId("file.create"));
}

TEST(File, LeavesNoTemporaryBehind) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a", "1"), IsOk());
    ASSERT_THAT(writeTextFile(dir / "a", "2"), IsOk());
    std::filesystem::create_directory(dir / "folder");
    EXPECT_FALSE(static_cast<bool>(writeTextFile(dir / "folder", "3")));
    size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(dir.path())) count++;
    EXPECT_EQ(count, 2u);
}

// A reader sees one of the texts, never a mixture.
TEST(File, WritersDoNotMix) {
    const TempDir dir;
    const std::filesystem::path path = dir / "shared";
    ASSERT_THAT(writeTextFile(path, std::string(100000, '0')), IsOk());
    std::vector<std::thread> writers;
    for (char c = '1'; c <= '3'; c++)
        writers.emplace_back([&path, c] {
            for (int i = 0; i < 20; i++) EXPECT_THAT(writeTextFile(path, std::string(100000, c)), IsOk());
        });
    for (int i = 0; i < 50; i++) {
        const Expected<std::string> text = readTextFile(path);
        ASSERT_THAT(text, IsOk());
        EXPECT_EQ(*text, std::string(100000, text->at(0)));
    }
    for (std::thread& writer : writers) writer.join();
}

TEST(File, InPieces) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a", "0123456789"), IsOk());
    const Expected<InputFile> file = InputFile::open(dir / "a");
    ASSERT_THAT(file, IsOk());
    EXPECT_EQ(file->size(), 10u);
    const auto read = [&](uint64_t offset, size_t size) {
        std::string text(size, ' ');
        return file->read(offset, std::as_writable_bytes(std::span(text))) ? text : "none";
    };
    EXPECT_EQ(read(0, 10), "0123456789");
    EXPECT_EQ(read(7, 3), "789");
    EXPECT_EQ(read(2, 4), "2345");
    EXPECT_EQ(read(10, 0), "");
    EXPECT_EQ(read(7, 4), "none");
    EXPECT_EQ(read(11, 1), "none");
    // Somebody makes it shorter while it is read.
    std::filesystem::resize_file(dir / "a", 5);
    std::string text(4, ' ');
    EXPECT_THAT(file->read(3, std::as_writable_bytes(std::span(text))), HasErrorId("file.read"));
    EXPECT_THAT(InputFile::open(dir / "absent"), HasErrorId("file.open"));
    EXPECT_THAT(InputFile::open(dir.path()), HasErrorId("file.open"));
    EXPECT_THAT(InputFile::open("/dev/zero"), HasErrorId("file.read"));
}
