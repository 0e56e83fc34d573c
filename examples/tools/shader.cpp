// glint shader: compiles, checks, shows and converts a shader.

#include "tool.h"

#include <glint/base/file.h>
#include <glint/shader/convert.h>
#include <glint/shader/shader_compiler.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::filesystem::path file;
    std::filesystem::path output;
    std::string stage;
    std::string entry = "main";
    std::string language;
    std::vector<std::string> macros;
    std::vector<std::filesystem::path> folders;
    bool validate = false;
    bool disassemble = false;
    bool reflect = false;
    bool json = false;
    bool optimize = false;
};

struct StageName {
    const char* name;
    const char* ending;
};

/// In the order of ShaderStage.
constexpr std::array<StageName, static_cast<size_t>(ShaderStage::Count)> stages = {{
    {"vertex", ".vert"},
    {"control", ".tesc"},
    {"evaluate", ".tese"},
    {"geometry", ".geom"},
    {"fragment", ".frag"},
    {"compute", ".comp"},
    {"task", ".task"},
    {"mesh", ".mesh"},
    {"raygen", ".rgen"},
    {"miss", ".rmiss"},
    {"closest", ".rchit"},
    {"firsthit", ".rahit"},
    {"intersection", ".rint"},
    {"callable", ".rcall"},
}};

const std::array<std::pair<const char*, ShadingLanguage>, 5> languages = {{
    {"vulkan", ShadingLanguage::VulkanGLSL},
    {"glsl", ShadingLanguage::GLSL},
    {"essl", ShadingLanguage::ESSL},
    {"hlsl", ShadingLanguage::HLSL},
    {"msl", ShadingLanguage::MSL},
}};

std::optional<ShaderStage> findStage(const char* StageName::*key, const std::string& text) {
    for (size_t i = 0; i < stages.size(); i++)
        if (text == stages[i].*key) return static_cast<ShaderStage>(i);
    return {};
}

/// "a.comp" and "a.comp.glsl" say what they are.
std::optional<ShaderStage> stageOfFile(std::filesystem::path file) {
    for (int i = 0; i < 2; i++) {
        if (const auto stage = findStage(&StageName::ending, file.extension().string())) return stage;
        file = file.stem();
    }
    return {};
}

Error usageError(std::string text) {
    return Error::inFile(ErrorCode::InvalidArgument, "tool.arguments", std::move(text), {}, 0);
}

Expected<ShaderSource> readSource(const Options& options) {
    ShaderSource source;
    source.name = options.file.string();
    source.entry = options.entry;
    source.include_paths = options.folders;
    for (const std::string& macro : options.macros) source.macros += (source.macros.empty() ? "" : "; ") + macro;

    const std::string ending = options.file.extension().string();
    std::optional<ShaderStage> stage =
        options.stage.empty() ? stageOfFile(options.file) : findStage(&StageName::name, options.stage);
    if (ending == ".spv") {
        const Expected<std::vector<std::byte>> bytes = readFile(options.file, 1u << 30);
        if (!bytes) return unexpected(bytes.error());
        source.language = ShaderSource::Language::SPIRV;
        source.words.resize(bytes->size() / sizeof(uint32_t));
        std::memcpy(source.words.data(), bytes->data(), source.words.size() * sizeof(uint32_t));
        if (bytes->size() % sizeof(uint32_t) != 0)
            return unexpected(Error::inFile(ErrorCode::InvalidArgument, "tool.spirv",
                                            fmt::format("{} bytes are no whole words", bytes->size()), source.name, 0));
        if (!stage) {
            const Expected<Reflection> reflection = reflect(source.words, options.entry);
            if (!reflection)
                return unexpected(Error::inFile(reflection.error().code(), reflection.error().id().data(),
                                                reflection.error().message(), source.name, 0));
            stage = reflection->stage;
        }
    } else {
        if (ending == ".spvasm") source.language = ShaderSource::Language::Assembly;
        Expected<std::string> text = readTextFile(options.file);
        if (!text) return unexpected(text.error());
        source.text = std::move(*text);
    }
    if (!stage)
        return unexpected(usageError(
            fmt::format("the ending of '{}' says no stage: --stage has to", options.file.filename().string())));
    source.stage = *stage;
    return source;
}

Expected<std::vector<uint32_t>> compileSource(const Options& options, const ShaderSource& source) {
    std::vector<uint32_t> words = source.words;
    if (source.language == ShaderSource::Language::GLSL) {
        const Expected<shader::Preprocessed> text = shader::preprocess(source);
        if (!text) return unexpected(text.error());
        Expected<std::vector<uint32_t>> compiled = shader::compile(source, *text);
        if (!compiled) return compiled;
        words = std::move(*compiled);
    } else if (source.language == ShaderSource::Language::Assembly) {
        Expected<std::vector<uint32_t>> assembled = shader::assemble(source);
        if (!assembled) return assembled;
        words = std::move(*assembled);
    }
    if (Status status = shader::validate(source, words); !status) return unexpected(status.error());
    return options.optimize ? shader::optimize(source, words) : words;
}

/// One resource and the slot by which a program names it.
struct SlotRow {
    const ShaderResource* resource;
    SlotKind kind;
    uint32_t slot;
};

std::vector<SlotRow> slotsOf(const BindingLayout& layout) {
    std::vector<SlotRow> rows;
    for (size_t kind = 0; kind < layout.slots.size(); kind++)
        for (uint32_t i = 0; i < layout.slots[kind].size(); i++)
            rows.push_back({&layout.resources[layout.slots[kind][i]], static_cast<SlotKind>(kind), i});
    return rows;
}

const char* accessOf(const ShaderResource& resource) {
    const bool is_storage = resource.element == SlotKind::Storage || resource.element == SlotKind::Surface ||
                            (resource.element == SlotKind::Texel && resource.texel_storage);
    if (!is_storage) return "read";
    return !resource.write ? "read" : resource.read ? "read write" : "write";
}

const char* dimensionOf(const ShaderResource& resource) {
    static constexpr const char* names[] = {"", "2D", "3D", "cube", "2D array", "cube array", "2D multisampled"};
    return names[static_cast<size_t>(resource.dimension)];
}

const char* typeName(SpecializationConstant::Type type) {
    static constexpr const char* names[] = {"bool", "int", "uint", "float"};
    return names[static_cast<size_t>(type)];
}

std::string variableType(const ShaderVariable& variable) {
    static constexpr const char* names[] = {"float", "int", "uint"};
    const char* name = names[static_cast<size_t>(variable.type)];
    return variable.components == 1 ? name : fmt::format("{}[{}]", name, variable.components);
}

std::string usesOf(const Reflection& reflection) {
    std::string text;
    const auto add = [&](bool uses, const char* name) {
        if (uses) text += (text.empty() ? "" : ", ") + std::string(name);
    };
    add(reflection.uses_ray_query, "ray queries");
    add(reflection.uses_addresses, "buffer addresses");
    add(reflection.uses_float64, "float64");
    add(reflection.uses_int64, "int64");
    add(reflection.uses_subgroups, "subgroups");
    return text;
}

bool hasGroups(ShaderStage stage) {
    return stage == ShaderStage::Compute || stage == ShaderStage::Task || stage == ShaderStage::Mesh;
}

std::string reflectionTable(const Reflection& reflection, const BindingLayout& layout) {
    std::string text = fmt::format("stage       {}\nentry       {}\n", toString(reflection.stage), reflection.entry);
    const auto& group = reflection.group_size;
    if (hasGroups(reflection.stage)) text += fmt::format("group       {} x {} x {}\n", group[0], group[1], group[2]);
    if (reflection.push_size) text += fmt::format("push        {} bytes\n", reflection.push_size);
    if (const std::string uses = usesOf(reflection); !uses.empty()) text += fmt::format("uses        {}\n", uses);
    if (!layout.resources.empty()) {
        text += fmt::format("\n{:<12}{:<13}{:<24}{:>6}{:>8}{:>8}  {:<11}{}\n", "slot", "set, binding", "name", "count",
                            "size", "stride", "access", "type");
        for (const SlotRow& row : slotsOf(layout)) {
            const ShaderResource& item = *row.resource;
            text += fmt::format(
                "{:<12}{:<13}{:<24}{:>6}{:>8}{:>8}  {:<11}{}\n", fmt::format("{} {}", toString(row.kind), row.slot),
                fmt::format("{}, {}", item.set, item.binding), item.name,
                item.count ? std::to_string(item.count) : "any", item.size ? std::to_string(item.size) : "",
                item.stride ? std::to_string(item.stride) : "", accessOf(item), dimensionOf(item));
        }
    }
    const auto variables = [&](const char* title, const std::vector<ShaderVariable>& list) {
        for (const ShaderVariable& item : list)
            text += fmt::format("{} {:<3} {:<24} {}\n", title, item.location, item.name, variableType(item));
    };
    if (!reflection.inputs.empty() || !reflection.outputs.empty() || !reflection.constants.empty()) text += '\n';
    variables("input   ", reflection.inputs);
    variables("output  ", reflection.outputs);
    for (const SpecializationConstant& item : reflection.constants)
        text += fmt::format("constant {:<3} {:<24} {} (default bits {:#x})\n", item.id, item.name, typeName(item.type),
                            item.default_value);
    return text;
}

std::string reflectionJson(const Reflection& reflection, const BindingLayout& layout) {
    nlohmann::ordered_json json = {
        {"stage", toString(reflection.stage)},         {"entry", reflection.entry},
        {"push_size", reflection.push_size},           {"uses_ray_query", reflection.uses_ray_query},
        {"uses_addresses", reflection.uses_addresses}, {"uses_float64", reflection.uses_float64},
        {"uses_int64", reflection.uses_int64},         {"uses_subgroups", reflection.uses_subgroups}};
    if (hasGroups(reflection.stage)) json["group_size"] = reflection.group_size;
    auto& resources = json["resources"] = nlohmann::ordered_json::array();
    for (const SlotRow& row : slotsOf(layout)) {
        const ShaderResource& item = *row.resource;
        nlohmann::ordered_json entry = {{"kind", toString(row.kind)}, {"slot", row.slot},  {"set", item.set},
                                        {"binding", item.binding},    {"name", item.name}, {"count", item.count},
                                        {"access", accessOf(item)}};
        if (!item.instance.empty()) entry["instance"] = item.instance;
        if (item.element == SlotKind::Uniform || item.element == SlotKind::Storage) {
            entry["size"] = item.size;
            entry["stride"] = item.stride;
            entry["row_major"] = item.has_row_major;
        }
        if (item.dimension != ImageDimension::None) entry["dimension"] = dimensionOf(item);
        resources.push_back(std::move(entry));
    }
    const auto variables = [&](const char* key, const std::vector<ShaderVariable>& list) {
        auto& array = json[key] = nlohmann::ordered_json::array();
        for (const ShaderVariable& item : list)
            array.push_back({{"location", item.location}, {"name", item.name}, {"type", variableType(item)}});
    };
    variables("inputs", reflection.inputs);
    variables("outputs", reflection.outputs);
    auto& constants = json["constants"] = nlohmann::ordered_json::array();
    for (const SpecializationConstant& item : reflection.constants)
        constants.push_back({{"id", item.id},
                             {"name", item.name},
                             {"type", typeName(item.type)},
                             {"default_bits", item.default_value}});
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Expected<std::string> reflectionText(const Options& options, const ShaderSource& source,
                                     std::span<const uint32_t> words) {
    const Expected<Reflection> reflection = reflect(words, source.entry);
    if (!reflection) return unexpected(reflection.error());
    const Reflection* const stage = &*reflection;
    const Expected<BindingLayout> layout = mergeLayouts({&stage, 1});
    if (!layout) return unexpected(layout.error());
    return options.json ? reflectionJson(*reflection, *layout) : reflectionTable(*reflection, *layout);
}

/// To the file that -o names, or to the standard output.
int put(const Options& options, const std::string& text) {
    if (!options.output.empty()) {
        const Status status = writeTextFile(options.output, text);
        return status ? 0 : fail("shader", status.error());
    }
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0) return 0;
    return fail("shader", Error::inFile(ErrorCode::Io, "file.write", "cannot write to the standard output", {}, 0));
}

int run(const Options& options) {
    const bool is_text = options.disassemble || options.reflect || !options.language.empty();
    if (options.disassemble + options.reflect + !options.language.empty() + options.validate > 1)
        return failUsage("shader", "one of --disassemble, --reflect, --validate and --to at a time");
    if (options.validate && !options.output.empty())
        return failUsage("shader", "--validate writes nothing that -o could name");
    if (options.json && !options.reflect) return failUsage("shader", "--json goes with --reflect");

    const Expected<ShaderSource> source = readSource(options);
    if (!source) {
        if (source.error().id() == "tool.arguments") return failUsage("shader", source.error().message());
        return fail("shader", source.error());
    }
    const Expected<std::vector<uint32_t>> words = compileSource(options, *source);
    if (!words) return fail("shader", words.error());

    if (is_text) {
        const auto text = [&]() -> Expected<std::string> {
            if (options.disassemble) return shader::disassemble(*words);
            if (options.reflect) return reflectionText(options, *source, *words);
            for (const auto& [name, language] : languages)
                if (options.language == name) return shader::convert(*source, *words, language);
            return unexpected(usageError("unknown language"));
        }();
        return text ? put(options, *text) : fail("shader", text.error());
    }
    if (!options.output.empty()) {
        const Status status = writeFile(options.output, std::as_bytes(std::span(*words)));
        if (!status) return fail("shader", status.error());
    }
    fmt::print("{}: {} stage, {} words of valid SPIR-V\n", options.file.string(), toString(source->stage),
               words->size());
    return 0;
}

template <class List, class Name>
std::string join(const List& list, Name&& name) {
    std::string text;
    for (const auto& each : list) text += (text.empty() ? "" : "|") + std::string(name(each));
    return text;
}

}  // namespace

Command shaderCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* sub = app.add_subcommand("shader", "Compiles a shader, shows what it declares, converts it");
    const std::string stage_names = join(stages, [](const StageName& stage) { return stage.name; });
    const std::string endings = join(stages, [](const StageName& stage) { return stage.ending; });
    const std::string language_names = join(languages, [](const auto& language) { return language.first; });
    sub->add_option("FILE", options->file,
                    "GLSL, SPIR-V (.spv) or SPIR-V assembly (.spvasm). The ending says the stage: " + endings)
        ->required();
    sub->add_option("--stage", options->stage, "Stage, where the ending does not say it")
        ->type_name(stage_names)
        ->check([](const std::string& text) {
            return findStage(&StageName::name, text) ? std::string() : "'" + text + "' is no stage";
        });
    sub->add_option("-D", options->macros, "Macro; several may be given")
        ->type_name("NAME[=VALUE]")
        ->allow_extra_args(false);
    sub->add_option("-I", options->folders, "Folder of includes; several may be given")
        ->type_name("FOLDER")
        ->allow_extra_args(false);
    sub->add_option("--entry", options->entry, "Entry point")->type_name("NAME")->capture_default_str();
    sub->add_option("-o,--output", options->output, "Where to write; texts go to the standard output without it")
        ->type_name("FILE");
    sub->add_flag("--optimize", options->optimize, "Optimise before anything is written or shown");
    sub->add_flag("--validate", options->validate, "Check only");
    sub->add_flag("--disassemble", options->disassemble, "Write SPIR-V assembly");
    sub->add_flag("--reflect", options->reflect, "Show slots, bindings, sizes, inputs, outputs and constants");
    sub->add_flag("--json", options->json, "With --reflect: as JSON");
    sub->add_option("--to", options->language, "Convert to GLSL for Vulkan, OpenGL GLSL, GLSL ES, HLSL or Metal")
        ->type_name(language_names)
        ->check([](const std::string& text) {
            for (const auto& [name, language] : languages)
                if (text == name) return std::string();
            return "'" + text + "' is no language";
        });
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
