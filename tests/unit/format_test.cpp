#include <glint/format/format.h>

#include <gtest/gtest.h>

#include <set>
#include <string>

using namespace glint;

TEST(Format, EveryEntryIsFilled) {
    std::set<std::string> names;
    for (int i = 1; i < FormatCount; i++) {
        const FormatInfo& info = formatInfo(static_cast<Format>(i));
        EXPECT_TRUE(names.insert(info.name).second) << info.name;
        EXPECT_NE(info.type, FormatType::None) << info.name;
        EXPECT_GE(info.components, 1) << info.name;
        EXPECT_LE(info.components, 4) << info.name;
        EXPECT_GE(info.block_size, 1) << info.name;
        EXPECT_LE(info.block_size, 16) << info.name;
        EXPECT_EQ(info.block_width, info.compressed ? 4 : 1) << info.name;
    }
    EXPECT_EQ(names.size(), static_cast<size_t>(FormatCount - 1));
}

// The name says all: channels, type and bits of each.
TEST(Format, EntriesAgreeWithTheirNames) {
    for (int i = 1; i < FormatCount; i++) {
        const FormatInfo& info = formatInfo(static_cast<Format>(i));
        const std::string name = info.name;
        EXPECT_EQ(info.srgb, name.ends_with("ns")) << name;
        EXPECT_EQ(info.depth, name.starts_with("D")) << name;
        EXPECT_EQ(info.depth, info.type == FormatType::Depth) << name;
        EXPECT_EQ(info.stencil, name.find("Su8") != std::string::npos) << name;
        EXPECT_EQ(info.compressed, name.starts_with("BC")) << name;
        const size_t letters = name.find_first_of("uif");
        if (info.compressed || info.depth || name.find_first_of("uifE", letters + 1) != std::string::npos) continue;
        if (name == "RGBEu9e5") continue;
        const std::string channels = name.substr(0, letters);
        const int bits = std::stoi(name.substr(letters + 1));
        EXPECT_EQ(info.components, channels.size()) << name;
        EXPECT_EQ(info.block_size * 8, bits * static_cast<int>(channels.size())) << name;
        const bool is_normalised = name.back() == 'n' || name.back() == 's';
        const FormatType type = is_normalised || name[letters] == 'f' ? FormatType::Float
                                : name[letters] == 'u'                ? FormatType::Uint
                                                                      : FormatType::Int;
        EXPECT_EQ(info.type, type) << name;
    }
}

TEST(Format, OutsideIsUnknown) {
    EXPECT_STREQ(toString(FormatUnknown), "Unknown");
    EXPECT_STREQ(toString(FormatCount), "Unknown");
    EXPECT_STREQ(toString(static_cast<Format>(255)), "Unknown");
    EXPECT_EQ(formatInfo(static_cast<Format>(255)).block_size, 0);
}
