#pragma once

// The program `glint`, run as a program.

#include "support/files.h"
#include "support/matchers.h"

#include <glint/base/file.h>
#include <glint/format/mesh.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

namespace glint::test {

struct Outcome {
    int status = -1;
    std::string output;
    std::string errors;
};

class Tool : public ::testing::Test {
protected:
    /// Runs `glint ARGUMENTS` in the folder; `before` is shell text that stands before it.
    Outcome run(const std::string& arguments, const std::string& before = {}) {
        const std::string command =
            fmt::format("cd '{}' && {} '{}' {} > .out 2> .err", dir.path().string(), before, GLINT_TOOL, arguments);
        const int status = std::system(command.c_str());
        Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, *readTextFile(dir / ".out"),
                        *readTextFile(dir / ".err")};
        std::filesystem::remove(dir / ".out");
        std::filesystem::remove(dir / ".err");
        return outcome;
    }

    Outcome expectSuccess(const std::string& arguments) {
        Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.status, 0) << arguments;
        EXPECT_EQ(outcome.errors, "") << arguments;
        return outcome;
    }

    /// One line on stderr, which ends in the id.
    void expectFailure(const std::string& arguments, int status, const std::string& id,
                       const std::string& before = {}) {
        const Outcome outcome = run(arguments, before);
        EXPECT_EQ(outcome.status, status) << arguments;
        EXPECT_TRUE(outcome.errors.ends_with("[" + id + "]\n")) << arguments << "\n" << outcome.errors;
        EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
    }

    void write(const char* name, std::string_view text) { ASSERT_THAT(writeTextFile(dir / name, text), IsOk()); }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(dir.path()))
            names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }

    const TempDir dir;
};

inline std::string objText(const Mesh& mesh) {
    std::string text;
    for (const Vector3f& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    for (size_t i = 0; i < mesh.indices.size(); i += 3)
        text += fmt::format("f {} {} {}\n", mesh.indices[i] + 1, mesh.indices[i + 1] + 1, mesh.indices[i + 2] + 1);
    return text;
}

}  // namespace glint::test
