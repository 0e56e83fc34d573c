#include "traversal_skeleton.h"

#include <glint/base/format_error.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

namespace glint::shader {

namespace {

using Group = TraversalSource::Group;

class Writer {
public:
    Writer(const TraversalSource& source, const SkeletonNeeds& needs) : source_(source), needs_(needs) {}

    std::string run() {
        add("#include <glint/tracing/pipeline.h>\n");
        const auto& [width, height, depth] = source_.group_size;
        add("layout(local_size_x = {}, local_size_y = {}, local_size_z = {}) in;\n", width, height, depth);
        for (const StageCopy& copy : stageCopies(source_, needs_)) add("void {}() {{}}\n", stageFunction(copy));
        add("void glintRunFirstHit(const uint group) {{\n");
        choose(TraversalSource::Hit, &Group::first_hit, 0);
        add("}}\nvoid glintRunIntersection(const uint group) {{\n");
        choose(TraversalSource::Hit, &Group::intersection, 0);
        add("}}\n");
        // The innermost first: nobody calls upwards.
        for (uint32_t level = callableLevels(source_, needs_); level > 0; level--) writeCallable(level);
        writeMain();
        return std::move(text_);
    }

private:
    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    }

    /// Runs the stage that the groups of a table have as this member, or, if that has pieces, makes it the next.
    void choose(TraversalSource::Table table, uint32_t Group::*member, uint32_t level) {
        std::map<uint32_t, std::vector<size_t>> stages;
        const std::vector<Group>& groups = source_.groups[table];
        for (size_t i = 0; i < groups.size(); i++)
            if (groups[i].*member != TraversalSource::none) stages[groups[i].*member].push_back(i);
        if (stages.empty()) return;
        add("switch (group) {{\n");
        for (const auto& [stage, indices] : stages) {
            for (const size_t index : indices) add("case {}u: ", index);
            if (needs_.resumes[stage])
                add("glint_stage = {}u; break;\n", stage);
            else
                add("{}(); break;\n", stageFunction(copyOf(stage, level)));
        }
        add("}}\n");
    }

    StageCopy copyOf(uint32_t stage, uint32_t level) const {
        const bool several = source_.stages[stage].stage == ShaderStage::Callable && needs_.calls[stage];
        return {stage, several ? level : 0};
    }

    void writeCallable(uint32_t level) {
        add("void glintCallable{}(const uint index) {{\n"
            "const uint group = glintFindRecord(GLINT_TABLE_CALLABLE, index);\n",
            level);
        choose(TraversalSource::Callable, &Group::general, level);
        add("}}\n");
    }

    /// Runs the stages of one or of all other kinds that have pieces, as far as they go.
    void runStages(bool generation) {
        for (uint32_t stage = 0; stage < source_.stages.size(); stage++)
            if (needs_.resumes[stage] && (source_.stages[stage].stage == ShaderStage::RayGen) == generation)
                add("if (glint_stage == {}u) {}();\n", stage, stageFunction({stage, 0}));
    }

    void writeMain() {
        add("void main() {{\n"
            "if (any(greaterThanEqual(gl_GlobalInvocationID, glint_launch.rays.xyz))) return;\n"
            "glint_launch_id = gl_GlobalInvocationID;\n"
            "glint_launch_size = glint_launch.rays.xyz;\n"
            "glint_unwind = false;\n"
            "glint_stage = GLINT_NO_STAGE;\n"
            "glint_piece = 0u;\n"
            "glint_level = 0u;\n"
            "uint group = glintFindRecord(GLINT_TABLE_GENERATION, glint_launch.rays.w);\n");
        choose(TraversalSource::Generation, &Group::general, 0);
        if (traceDepth(source_, needs_)) writeLoop();
        add("}}\n");
    }

    /// Where lanes run side by side, a turn of a loop costs each of its parts once if any lane needs that: so the
    /// search and what follows it is reached when all lanes that can have asked for a ray, and ray generation, to which
    /// most rays return, comes last.
    void writeLoop() {
        add("for (;;) {{\n"
            "glint_asks = false;\n"
            "for (;;) {{\n");
        runStages(false);
        add("if (glint_stage == GLINT_NO_STAGE && glint_level > 0u) glintReturn();\n");
        runStages(true);
        add("if (glint_asks || glint_stage == GLINT_NO_STAGE) break;\n"
            "}}\n"
            "if (!glint_asks) break;\n"
            "glintCall();\n"
            "bool hits;\n"
            "group = glintSearch(hits);\n"
            "if (!hits) {{\n"
            "group = glintFindRecord(GLINT_TABLE_MISS, glint_ray_miss);\n");
        choose(TraversalSource::Miss, &Group::general, 0);
        add("}} else if ((glint_ray_flags & gl_RayFlagsSkipClosestHitShaderEXT) == 0u) {{\n");
        choose(TraversalSource::Hit, &Group::closest, 0);
        add("}}\n");
        if (traceDepth(source_, needs_) > 1) add("if (glint_stage == GLINT_NO_STAGE) glintReturn();\n");
        add("}}\n");
    }

    const TraversalSource& source_;
    const SkeletonNeeds& needs_;
    std::string text_;
};

/// The members of all groups of a table, each once.
std::set<uint32_t> stagesOf(const TraversalSource& source, TraversalSource::Table table, uint32_t Group::*member) {
    std::set<uint32_t> stages;
    for (const Group& group : source.groups[table])
        if (group.*member != TraversalSource::none) stages.insert(group.*member);
    return stages;
}

}  // namespace

uint32_t traceDepth(const TraversalSource& source, const SkeletonNeeds& needs) {
    uint32_t depth = 0;
    for (size_t i = 0; i < source.stages.size(); i++)
        if (needs.resumes[i])
            depth = std::max(depth, source.stages[i].stage == ShaderStage::RayGen ? 1 : source.recursion_depth);
    return depth;
}

uint32_t callableLevels(const TraversalSource& source, const SkeletonNeeds& needs) {
    uint32_t levels = 0;
    for (size_t i = 0; i < source.stages.size(); i++)
        if (needs.calls[i])
            levels =
                std::max(levels, source.stages[i].stage == ShaderStage::Callable ? source.callable_depth
                                                                                 : std::min(source.callable_depth, 1u));
    return levels;
}

std::vector<StageCopy> stageCopies(const TraversalSource& source, const SkeletonNeeds& needs) {
    std::vector<StageCopy> copies;
    const auto add = [&](TraversalSource::Table table, uint32_t Group::*member) {
        for (const uint32_t stage : stagesOf(source, table, member)) copies.push_back({stage, 0});
    };
    add(TraversalSource::Generation, &Group::general);
    add(TraversalSource::Hit, &Group::first_hit);
    add(TraversalSource::Hit, &Group::intersection);
    if (traceDepth(source, needs)) {
        add(TraversalSource::Miss, &Group::general);
        add(TraversalSource::Hit, &Group::closest);
    }
    if (const uint32_t deepest = callableLevels(source, needs))
        for (const uint32_t stage : stagesOf(source, TraversalSource::Callable, &Group::general)) {
            if (!needs.calls[stage]) copies.push_back({stage, 0});
            for (uint32_t level = 1; needs.calls[stage] && level <= deepest; level++) copies.push_back({stage, level});
        }
    return copies;
}

std::string stageFunction(const StageCopy& copy) { return fmt::format("glintStage{}_{}", copy.stage, copy.level); }

ShaderSource skeletonSource(const TraversalSource& source, const SkeletonNeeds& needs) {
    ShaderSource result;
    result.stage = ShaderStage::Compute;
    result.name = "<pipeline>";
    result.text = Writer(source, needs).run();
    result.macros = fmt::format("GLINT_JOIN_SET={}; GLINT_JOIN_BINDING={}; GLINT_DEPTH={}; GLINT_SAVED_WORDS={}; "
                                "GLINT_PAYLOAD_WORDS={}; GLINT_CALLABLE_WORDS={}; "
                                "GLINT_ATTRIBUTE_WORDS={}; GLINT_PUSH_WORDS={}",
                                source.set, source.binding, traceDepth(source, needs), std::max(needs.saved_words, 1u),
                                std::max(needs.payload_words, 1u), std::max(needs.callable_words, 1u),
                                std::max(needs.attribute_words, 2u), std::max(needs.push_words, 1u));
    const auto use = [&](bool is_used, std::string_view what) {
        if (is_used) fmt::format_to(std::back_inserter(result.macros), "; GLINT_USES_{}", what);
    };
    use(needs.push_words != 0, "PUSH");
    use(needs.custom_index, "CUSTOM_INDEX");
    use(needs.object_ray, "OBJECT_RAY");
    use(needs.to_world, "TO_WORLD");
    use(needs.to_object, "TO_OBJECT");
    use(!stagesOf(source, TraversalSource::Hit, &Group::first_hit).empty(), "FIRST_HIT");
    use(!stagesOf(source, TraversalSource::Hit, &Group::intersection).empty(), "INTERSECTION");
    return result;
}

}  // namespace glint::shader
