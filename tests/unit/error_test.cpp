#include "support/matchers.h"

#include <glint/base/error.h>
#include <glint/base/expected.h>
#include <glint/base/format_error.h>
#include <glint/base/hash.h>
#include <glint/base/log.h>
#include <glint/base/status.h>

#include <set>

using namespace glint;
using namespace glint::test;

TEST(Error, NoneIsEmpty) {
    const Error error;
    EXPECT_FALSE(error);
    EXPECT_EQ(error.code(), ErrorCode::None);
    EXPECT_EQ(error.id(), "");
    EXPECT_EQ(error.text(), "");
    EXPECT_EQ(error.line(), 0u);
}

TEST(Error, TextNamesTheCallersLine) {
    const uint32_t line = __LINE__ + 1;
    const Error error(ErrorCode::OutOfRange, "buffer.range", "offset 8 is past the end", "values");
    EXPECT_TRUE(error);
    EXPECT_EQ(error.text(), "error_test.cpp:" + std::to_string(line) + ": offset 8 is past the end [buffer.range]");
    EXPECT_EQ(error.object(), "values");
    EXPECT_EQ(error.file(), "error_test.cpp");
}

TEST(Error, InFileKeepsItsPlace) {
    const Error error = Error::inFile(ErrorCode::ShaderCompile, "shader.compile", "'valeus' : undeclared identifier",
                                      "scale.shader", 7, "GROUP_SIZE=64");
    EXPECT_EQ(error.text(), "scale.shader:7 (GROUP_SIZE=64): 'valeus' : undeclared identifier [shader.compile]");
    EXPECT_EQ(error.at(std::source_location::current()).text(), error.text());
}

TEST(Error, AtAddsThePlaceOfTheCaller) {
    const Error error = makeError(ErrorCode::Io, "file.open", "cannot open '{}'", "a.png");
    EXPECT_EQ(error.text(), "cannot open 'a.png' [file.open]");
    const uint32_t line = __LINE__ + 1;
    const Error placed = error.at(std::source_location::current());
    EXPECT_EQ(placed.line(), line);
    EXPECT_EQ(placed.id(), "file.open");
    EXPECT_EQ(Error().at(std::source_location::current()).text(), "");
}

TEST(Error, NamedCopiesLeaveTheOriginal) {
    const Error error(ErrorCode::Internal, "x.y", "message");
    const Error named = error.named("object");
    EXPECT_EQ(named.object(), "object");
    EXPECT_EQ(error.object(), "");
    EXPECT_EQ(named.line(), error.line());
    EXPECT_FALSE(Error().named("object"));
}

TEST(Error, CodesHaveDistinctNames) {
    std::set<std::string> names;
    for (int code = 0; code <= static_cast<int>(ErrorCode::Internal); code++)
        names.insert(toString(static_cast<ErrorCode>(code)));
    EXPECT_EQ(names.size(), 9u);
    EXPECT_EQ(names.count("Unknown"), 0u);
}

TEST(Status, IsTrueOnSuccess) {
    const Status success;
    EXPECT_TRUE(static_cast<bool>(success));
    EXPECT_FALSE(success.error());
    EXPECT_TRUE(static_cast<bool>(Status(Error())));
    const Status failure = Error(ErrorCode::Io, "file.open", "no");
    EXPECT_FALSE(static_cast<bool>(failure));
    EXPECT_THAT(failure, HasErrorId("file.open"));
    EXPECT_THAT(success, IsOk());
}

TEST(Expected, CarriesTheError) {
    const auto half = [](int value) -> Expected<int> {
        if (value % 2) return unexpected(Error(ErrorCode::InvalidArgument, "value.odd", "odd"));
        return value / 2;
    };
    ASSERT_THAT(half(4), IsOk());
    EXPECT_EQ(*half(4), 2);
    EXPECT_THAT(half(3), HasErrorId("value.odd"));
    EXPECT_THAT(half(4), testing::Not(HasErrorId("value.odd")));
}

TEST(Hash, IsStableAndSensitive) {
    EXPECT_EQ(hashText("glint"), hashText("glint"));
    EXPECT_NE(hashText("glint"), hashText("glinu"));
    EXPECT_EQ(hashText("").hex().size(), 32u);
    EXPECT_EQ((Hash{.low = 0x1, .high = 0xab}).hex(), "00000000000000ab0000000000000001");
}

TEST(Hash, ChainDependsOnEveryLink) {
    const Hash a = hashText("a");
    EXPECT_NE(hashText("b", a), hashText("b"));
    EXPECT_NE(hashText("b", a), hashText("b", hashText("c")));
    EXPECT_NE(hashText("b", Hash{.low = 1, .high = 0}), hashText("b", Hash{.low = 1, .high = 1}));
}

TEST(Log, GoesToTheReceiver) {
    std::string seen;
    setLogCallback([&](LogLevel level, std::string_view id, std::string_view text) {
        EXPECT_EQ(level, LogLevel::Warning);
        seen += std::string(id) + ": " + std::string(text);
    });
    log(LogLevel::Warning, "test.id", "text");
    setLogCallback({});
    EXPECT_EQ(seen, "test.id: text");
}

TEST(Log, ReceiverMayLogAndBeReplaced) {
    int count = 0;
    setLogCallback([&](LogLevel, std::string_view, std::string_view) {
        count++;
        setLogCallback([&](LogLevel, std::string_view, std::string_view) { count += 10; });
        if (count == 1) log(LogLevel::Info, "test.id", "again");
    });
    log(LogLevel::Info, "test.id", "first");
    setLogCallback({});
    EXPECT_EQ(count, 11);
}
