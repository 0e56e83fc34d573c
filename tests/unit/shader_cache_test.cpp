#include "shader_test.h"

#include <glint/base/log.h>

#include <core/shader/shader_cache.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <thread>

using namespace glint;
using namespace glint::test;

namespace fs = std::filesystem;

namespace {

class ShaderCache : public ShaderTest {
protected:
    ShaderCache() { setShaderCache(folder()); }
    ~ShaderCache() override { setLogCallback({}); }

    fs::path folder() const { return dir_ / "cache"; }

    static ShaderSource small(int number = 1) {
        // All of one size.
        return glsl(fmt::format("layout(local_size_x = {}) in;\n"
                                "layout(set = 1, binding = 2) buffer Values {{ float values[]; }} named;\n"
                                "layout(constant_id = 4) const float factor = 2.5;\n"
                                "void main() {{ named.values[gl_LocalInvocationIndex] *= factor; }}\n",
                                100 + number));
    }

    std::vector<fs::path> entries() const {
        std::vector<fs::path> result;
        std::error_code none;
        for (const auto& file : fs::directory_iterator(folder(), none))
            if (file.path().extension() == ".glint") result.push_back(file.path());
        return result;
    }

    /// What all entries take, with no store going on meanwhile.
    uint64_t bytes() const {
        const int ledger = ::open((folder() / "glint.ledger").c_str(), O_RDONLY);
        if (ledger >= 0) ::flock(ledger, LOCK_EX);
        uint64_t sum = 0;
        for (const fs::path& path : entries()) sum += stampFile(path).size;
        if (ledger >= 0) ::close(ledger);
        return sum;
    }

    /// Compiles, and says whether the cache had it.
    static bool isHit(const ShaderSource& source) {
        const Expected<CompiledShader> result = compileShader(source);
        EXPECT_THAT(result, IsOk());
        return result && result->from_cache;
    }

    static std::string readBytes(const fs::path& path) {
        const Expected<std::string> text = readTextFile(path);
        return text ? *text : std::string();
    }

private:
    TempDir dir_;
};

void expectEqual(const Reflection& a, const Reflection& b) {
    CompiledShader first, second;
    first.reflection = a;
    second.reflection = b;
    EXPECT_EQ(shader::encodeShader(first), shader::encodeShader(second));
}

}  // namespace

TEST_F(ShaderCache, SecondTimeIsAHit) {
    const Expected<CompiledShader> first = compileShader(small());
    ASSERT_THAT(first, IsOk());
    EXPECT_FALSE(first->from_cache);
    const Expected<CompiledShader> second = compileShader(small());
    ASSERT_THAT(second, IsOk());
    EXPECT_TRUE(second->from_cache);
    EXPECT_EQ(second->words, first->words);
    expectEqual(second->reflection, first->reflection);
    ASSERT_EQ(second->reflection.resources.size(), 1u);
    EXPECT_EQ(second->reflection.resources[0].name, "Values");
    EXPECT_EQ(second->reflection.resources[0].instance, "named");
    EXPECT_EQ(second->reflection.resources[0].stride, 4u);
    EXPECT_EQ(second->reflection.constants.at(0).default_value, 0x40200000u);
    EXPECT_EQ(entries().size(), 1u);
}

TEST_F(ShaderCache, EveryInputIsPartOfTheKey) {
    ShaderSource source = small();
    EXPECT_FALSE(isHit(source));
    source.macros = "UNUSED=1";
    EXPECT_FALSE(isHit(source));
    source.macros = "UNUSED=2";
    EXPECT_FALSE(isHit(source));
    setShaderMacro("GLOBAL", "1");
    EXPECT_FALSE(isHit(source));
    clearShaderMacros();
    EXPECT_TRUE(isHit(source));
    source = glsl("void main() {}\n", ShaderStage::Vertex);
    EXPECT_FALSE(isHit(source));
    source.stage = ShaderStage::Fragment;
    EXPECT_FALSE(isHit(source));
    const Expected<CompiledShader> words = compileShader(source);
    ASSERT_THAT(words, IsOk());
    EXPECT_FALSE(isHit(binary(words->words, ShaderStage::Fragment)));
    EXPECT_TRUE(isHit(binary(words->words, ShaderStage::Fragment)));
    const std::string text = shader::disassemble(words->words);
    EXPECT_FALSE(isHit(assembly(text, ShaderStage::Fragment)));
    EXPECT_TRUE(isHit(assembly(text, ShaderStage::Fragment)));
    EXPECT_TRUE(isHit(source));
}

TEST_F(ShaderCache, IncludesArePartOfTheKey) {
    include("value.h", "#define VALUE 1.0\n");
    const ShaderSource source = glsl("#include \"value.h\"\nlayout(set = 0, binding = 0) buffer B { float b; };\n"
                                     "void main() { b = VALUE; }\n");
    const Expected<CompiledShader> one = compileShader(source);
    ASSERT_THAT(one, IsOk());
    EXPECT_TRUE(isHit(source));
    include("value.h", "#define VALUE 2.0\n");
    const Expected<CompiledShader> two = compileShader(source);
    ASSERT_THAT(two, IsOk());
    EXPECT_FALSE(two->from_cache);
    EXPECT_NE(two->words, one->words);
    include("value.h", "#define VALUE 1.0\n");
    EXPECT_TRUE(isHit(source));
}

TEST_F(ShaderCache, AHitKnowsItsFiles) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "a.h", "#define A 1.0\n"), IsOk());
    ShaderSource source = glsl("#include \"a.h\"\nlayout(set = 0, binding = 0) buffer B { float b; };\n"
                               "void main() { b = A; }\n");
    source.include_paths = {dir.path()};
    EXPECT_FALSE(isHit(source));
    const Expected<CompiledShader> hit = compileShader(source);
    ASSERT_THAT(hit, IsOk());
    EXPECT_TRUE(hit->from_cache);
    EXPECT_EQ(hit->files, (std::vector<fs::path>{dir / "a.h"}));
    EXPECT_FALSE(filesChanged(hit->stamps));
    ASSERT_THAT(writeTextFile(dir / "a.h", "#define A 22.0\n"), IsOk());
    EXPECT_TRUE(filesChanged(hit->stamps));
    EXPECT_FALSE(isHit(source));
}

TEST_F(ShaderCache, FailuresAreNotKept) {
    EXPECT_THAT(compileShader(glsl("void main() { x = 1; }")), HasErrorId("shader.compile"));
    EXPECT_THAT(compileShader(glsl("void main() { x = 1; }")), HasErrorId("shader.compile"));
    EXPECT_TRUE(entries().empty());
}

TEST_F(ShaderCache, DamagedEntriesAreMadeAnew) {
    const Expected<CompiledShader> good = compileShader(small());
    ASSERT_THAT(good, IsOk());
    ASSERT_EQ(entries().size(), 1u);
    const fs::path path = entries()[0];
    const std::string content = readBytes(path);
    int told = 0;
    setLogCallback([&](LogLevel, std::string_view id, std::string_view) { told += id == "shader.cache_damaged"; });

    std::vector<std::string> damaged = {"",
                                        "x",
                                        content + "x",
                                        content.substr(0, content.size() - 1),
                                        content.substr(0, 40),
                                        std::string(content.size(), '\0'),
                                        std::string(1 << 20, 'x')};
    std::mt19937 random(5);
    for (int i = 0; i < 100; i++) {
        damaged.push_back(content);
        damaged.back()[random() % content.size()] ^= static_cast<char>(1 + random() % 255);
    }
    for (const std::string& bytes : damaged) {
        std::ofstream(path, std::ios::binary) << bytes;
        const Expected<CompiledShader> again = compileShader(small());
        ASSERT_THAT(again, IsOk());
        EXPECT_FALSE(again->from_cache);
        EXPECT_EQ(again->words, good->words);
        EXPECT_EQ(readBytes(path), content);
    }
    EXPECT_EQ(told, static_cast<int>(damaged.size()));
    EXPECT_TRUE(isHit(small()));
}

TEST_F(ShaderCache, AnEntryUnderAnotherNameIsNoHit) {
    EXPECT_FALSE(isHit(small(1)));
    const fs::path first = entries()[0];
    EXPECT_FALSE(isHit(small(2)));
    const std::vector<fs::path> both = entries();
    ASSERT_EQ(both.size(), 2u);
    fs::copy_file(first, both[0] == first ? both[1] : both[0], fs::copy_options::overwrite_existing);
    EXPECT_FALSE(isHit(small(2)));
    EXPECT_TRUE(isHit(small(1)));
}

TEST_F(ShaderCache, DecodingStopsAtNonsense) {
    const Expected<CompiledShader> good = compileShader(small());
    ASSERT_THAT(good, IsOk());
    const std::vector<std::byte> bytes = shader::encodeShader(*good);
    ASSERT_TRUE(shader::decodeShader(bytes));
    for (size_t size = 0; size < bytes.size(); size++)
        EXPECT_FALSE(shader::decodeShader(std::span(bytes).first(size))) << size;
    std::mt19937 random(6);
    for (int i = 0; i < 2000; i++) {
        std::vector<std::byte> changed = bytes;
        for (int k = 0; k < 3; k++) changed[random() % changed.size()] = static_cast<std::byte>(random());
        (void)shader::decodeShader(changed);
    }
}

TEST_F(ShaderCache, OldEntriesGiveWayToNewOnes) {
    EXPECT_FALSE(isHit(small(1)));
    const uint64_t entry = bytes();
    setShaderCache(folder(), entry * 8 + 100);
    for (int i = 2; i <= 8; i++) EXPECT_FALSE(isHit(small(i)));
    EXPECT_EQ(entries().size(), 8u);
    // Uses count, not ages.
    EXPECT_TRUE(isHit(small(1)));
    for (int i = 9; i <= 40; i++) {
        EXPECT_FALSE(isHit(small(i)));
        EXPECT_LE(bytes(), entry * 8 + 100);
        EXPECT_TRUE(isHit(small(1)));
        EXPECT_TRUE(isHit(small(i)));
    }
    EXPECT_GE(entries().size(), 5u);
    EXPECT_FALSE(isHit(small(2)));
}

TEST_F(ShaderCache, ALimitTooSmallKeepsNothing) {
    setShaderCache(folder(), 100);
    EXPECT_FALSE(isHit(small()));
    EXPECT_FALSE(isHit(small()));
    EXPECT_EQ(bytes(), 0u);
    setShaderCache(folder(), 0);
    EXPECT_FALSE(isHit(small()));
}

TEST_F(ShaderCache, OtherFilesInTheFolderAreLeftAlone) {
    fs::create_directories(folder());
    ASSERT_THAT(writeTextFile(folder() / "notes.txt", std::string(100000, 'x')), IsOk());
    ASSERT_THAT(writeTextFile(folder() / "mine.glint", std::string(100000, 'x')), IsOk());
    setShaderCache(folder(), 8000);
    for (int i = 1; i <= 20; i++) EXPECT_FALSE(isHit(small(i)));
    EXPECT_EQ(stampFile(folder() / "notes.txt").size, 100000u);
    EXPECT_EQ(stampFile(folder() / "mine.glint").size, 100000u);
    EXPECT_LE(bytes() - 100000, 8000u);
}

TEST_F(ShaderCache, ALostLedgerIsRestored) {
    EXPECT_FALSE(isHit(small(1)));
    const uint64_t entry = bytes();
    setShaderCache(folder(), entry * 4 + 100);
    for (int i = 2; i <= 30; i++) {
        switch (i % 3) {
            case 0: fs::remove(folder() / "glint.ledger"); break;
            case 1: std::ofstream(folder() / "glint.ledger") << "nonsense"; break;
            default: break;
        }
        EXPECT_FALSE(isHit(small(i)));
        EXPECT_LE(bytes(), entry * 4 + 100);
        EXPECT_TRUE(isHit(small(i)));
    }
}

TEST_F(ShaderCache, LeftoversOfKilledProcessesGo) {
    EXPECT_FALSE(isHit(small(1)));
    const fs::path old = entries()[0].string() + ".1.0.tmp";
    const fs::path fresh = entries()[0].string() + ".2.0.tmp";
    ASSERT_THAT(writeTextFile(old, "half"), IsOk());
    ASSERT_THAT(writeTextFile(fresh, "half"), IsOk());
    fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(1));
    setShaderCache(folder(), bytes() + 10);
    EXPECT_FALSE(isHit(small(2)));
    EXPECT_FALSE(fs::exists(old));
    EXPECT_TRUE(fs::exists(fresh));
}

TEST_F(ShaderCache, AnUnusableFolderIsToldOnceAndHurtsNobody) {
    const TempDir dir;
    ASSERT_THAT(writeTextFile(dir / "file", "no folder"), IsOk());
    int told = 0;
    setLogCallback([&](LogLevel level, std::string_view id, std::string_view) {
        told += id == "shader.cache_unusable" && level == LogLevel::Warning;
    });
    setShaderCache(dir / "file");
    EXPECT_FALSE(isHit(small()));
    EXPECT_FALSE(isHit(small()));
    EXPECT_EQ(told, 1);
    setShaderCache({});
    EXPECT_FALSE(isHit(small()));
    EXPECT_FALSE(isHit(small()));
    EXPECT_EQ(told, 1);
}

TEST_F(ShaderCache, ThreadsShareIt) {
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; thread++)
        threads.emplace_back([thread] {
            for (int i = 0; i < 20; i++) EXPECT_THAT(compileShader(small(1 + (i + thread) % 10)), IsOk());
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(entries().size(), 10u);
    for (int i = 1; i <= 10; i++) EXPECT_TRUE(isHit(small(i)));
}

// Several processes fill a cache that holds a fraction of what they make, while one damages entries.
TEST_F(ShaderCache, ProcessesShareIt) {
    EXPECT_FALSE(isHit(small(1)));
    const uint64_t limit = bytes() * 6;
    setShaderCache(folder(), limit);
    std::vector<pid_t> children;
    for (unsigned process = 0; process < 4; process++) {
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            int failures = 0;
            std::mt19937 random(process);
            setLogCallback([](LogLevel, std::string_view, std::string_view) {});
            for (int i = 0; i < 60; i++) {
                const uint32_t number = 1 + random() % 12;
                const Expected<CompiledShader> result = compileShader(small(static_cast<int>(number)));
                if (!result || result->reflection.group_size[0] != 100 + number || result->words.empty()) failures++;
                if (bytes() > limit) failures++;
                if (process != 0 || i % 5 != 0) continue;
                for (const fs::path& path : entries()) std::ofstream(path, std::ios::in | std::ios::binary) << "damage";
            }
            ::_exit(failures);
        }
        children.push_back(child);
    }
    for (const pid_t child : children) {
        int status = -1;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    }
    setLogCallback([](LogLevel, std::string_view, std::string_view) {});
    EXPECT_LE(bytes(), limit);
    for (int i = 1; i <= 12; i++) EXPECT_THAT(compileShader(small(i)), IsOk());
    for (const auto& file : fs::directory_iterator(folder())) EXPECT_NE(file.path().extension(), ".tmp") << file.path();
}

TEST_F(ShaderCache, WhereItIsByDefault) {
    // In a process of its own, whose environment may change.
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        int failures = 0;
        const auto expect = [&](const fs::path& path) { failures += shader::defaultCacheFolder() != path; };
        ::setenv("GLINT_CACHE", "/a/chosen", 1);
        ::setenv("XDG_CACHE_HOME", "/b", 1);
        ::setenv("HOME", "/c", 1);
        expect("/a/chosen");
        ::setenv("GLINT_CACHE", "", 1);
        expect("");
        ::unsetenv("GLINT_CACHE");
        expect("/b/glint");
        ::unsetenv("XDG_CACHE_HOME");
        expect("/c/.cache/glint");
        ::unsetenv("HOME");
        expect("");
        ::_exit(failures);
    }
    int status = -1;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}
