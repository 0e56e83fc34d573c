// Every message id in the sources stands in the table of docs/errors.md, every id in the table is in the sources, and
// no comment promises one that nothing raises.

#include <glint/base/file.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace glint::test {

namespace {

const std::filesystem::path root = GLINT_SOURCE_DIR;

/// Where an id was seen: one place will do.
using Ids = std::map<std::string, std::string>;

struct Sources {
    Ids raised;     ///< in code
    Ids mentioned;  ///< in comments
};

void collect(const std::string& text, const std::set<std::string>& groups, const std::string& place, Ids& ids) {
    static const std::regex literal("\"([a-z]+)\\.([a-z][a-z0-9_]*)\"");
    for (std::sregex_iterator match(text.begin(), text.end(), literal), end; match != end; ++match)
        if (groups.count((*match)[1]) && (*match)[2] != "h")
            ids.emplace((*match)[1].str() + "." + (*match)[2].str(), place);
}

/// Calls visit(code, comment, place) for each line of the sources that quotes something.
template <class Visit>
void forEachLine(Visit&& visit) {
    for (const char* folder : {"core", "platform"})
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".h" && extension != ".cpp") continue;
            const Expected<std::string> text = readTextFile(entry.path());
            ASSERT_TRUE(text) << text.error().text();
            const std::string name = std::filesystem::relative(entry.path(), root).string() + ":";
            std::istringstream lines(*text);
            std::string line;
            for (int number = 1; std::getline(lines, line); number++) {
                if (line.find('"') == std::string::npos) continue;
                const size_t comment = line.find("//");
                visit(line.substr(0, comment), comment == std::string::npos ? std::string() : line.substr(comment),
                      name + std::to_string(number));
            }
        }
}

/// The ids of the table: | `group.name` | ...
Ids documented() {
    Ids ids;
    const Expected<std::string> text = readTextFile(root / "docs" / "errors.md");
    EXPECT_TRUE(text) << text.error().text();
    if (!text) return ids;
    static const std::regex row("(^|\n)\\| `([a-z]+\\.[a-z][a-z0-9_]*)` \\|");
    for (std::sregex_iterator match(text->begin(), text->end(), row), end; match != end; ++match)
        EXPECT_TRUE(ids.emplace((*match)[2], "docs/errors.md").second) << (*match)[2] << " stands in the table twice";
    return ids;
}

/// What a literal has to begin with to be an id: what an error is made with somewhere, or the table has.
std::set<std::string> groupsOf(const Ids& table) {
    std::set<std::string> groups;
    for (const auto& [id, place] : table) groups.insert(id.substr(0, id.find('.')));
    static const std::regex made("ErrorCode::[A-Za-z]+,\\s*\"([a-z]+)\\.[a-z][a-z0-9_]*\"");
    forEachLine([&](const std::string& code, const std::string&, const std::string&) {
        for (std::sregex_iterator match(code.begin(), code.end(), made), end; match != end; ++match)
            groups.insert((*match)[1]);
    });
    return groups;
}

Sources readSources(const std::set<std::string>& groups) {
    Sources sources;
    forEachLine([&](const std::string& code, const std::string& comment, const std::string& place) {
        collect(code, groups, place, sources.raised);
        collect(comment, groups, place, sources.mentioned);
    });
    return sources;
}

void expectSubset(const Ids& some, const Ids& all, const char* complaint) {
    for (const auto& [id, place] : some) EXPECT_TRUE(all.count(id)) << place << ": \"" << id << "\" " << complaint;
}

}  // namespace

TEST(ErrorIds, AreThoseOfTheTable) {
    const Ids table = documented();
    const Sources sources = readSources(groupsOf(table));
    EXPECT_GT(sources.raised.size(), 100u);
    expectSubset(sources.raised, table, "is missing in the table of docs/errors.md");
    expectSubset(table, sources.raised, "is not raised anywhere");
}

TEST(ErrorIds, InCommentsAreRaised) {
    const Sources sources = readSources(groupsOf(documented()));
    expectSubset(sources.mentioned, sources.raised, "is promised by a comment and not raised anywhere");
}

}  // namespace glint::test
