#include <glint/format/detail/gltf_document.h>

#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <span>

namespace glint::detail {

namespace {

using nlohmann::json;

enum class Kind : uint8_t {
    Boolean,
    Integer,
    Number,
    Numbers,
    String,
    Choice,   // a string, one of those in `choices`
    Code,     // an integer, one of those
    Index,    // of an element of the root's array `choices`
    Indices,  // an array of these
    Names,    // an object whose values are such indices
    NamesList,
    Object,
    Objects,
};

struct Property;
using Schema = std::span<const Property>;

struct Property {
    const char* name;
    Kind kind;
    bool is_required = false;
    double min = -FLT_MAX;
    double max = FLT_MAX;
    size_t count = 0;               // of the numbers in an array; 0 is any
    std::string_view choices = {};  // "LINEAR|STEP|", each with its end
    Schema schema = {};
};

constexpr double beyond_zero = FLT_TRUE_MIN;
constexpr double max_size = 0x1p53;     // what a JSON number holds exactly
constexpr double max_int = 0x7fffffff;  // what tinygltf keeps of some sizes

// One table an object, in the words of the specification's JSON schema. What is not here is not read.

constexpr Property asset[] = {{"version", Kind::String, true}, {"minVersion", Kind::String}};

constexpr Property buffer[] = {{"byteLength", Kind::Integer, true, 1, max_size}, {"uri", Kind::String}};

constexpr Property buffer_view[] = {
    {.name = "buffer", .kind = Kind::Index, .is_required = true, .choices = "buffers"},
    {"byteOffset", Kind::Integer, false, 0, max_size},
    {"byteLength", Kind::Integer, true, 1, max_size},
    {"byteStride", Kind::Integer, false, 4, 252},
};

constexpr Property sparse_indices[] = {
    {.name = "bufferView", .kind = Kind::Index, .is_required = true, .choices = "bufferViews"},
    {"byteOffset", Kind::Integer, false, 0, max_int},
    {.name = "componentType", .kind = Kind::Code, .is_required = true, .choices = "5121|5123|5125|"},
};
constexpr Property sparse_values[] = {
    {.name = "bufferView", .kind = Kind::Index, .is_required = true, .choices = "bufferViews"},
    {"byteOffset", Kind::Integer, false, 0, max_int},
};
constexpr Property sparse[] = {
    {"count", Kind::Integer, true, 1, max_int},
    {.name = "indices", .kind = Kind::Object, .is_required = true, .schema = sparse_indices},
    {.name = "values", .kind = Kind::Object, .is_required = true, .schema = sparse_values},
};
constexpr Property accessor[] = {
    {.name = "bufferView", .kind = Kind::Index, .choices = "bufferViews"},
    {"byteOffset", Kind::Integer, false, 0, max_size},
    {.name = "componentType", .kind = Kind::Code, .is_required = true, .choices = "5120|5121|5122|5123|5125|5126|"},
    {"normalized", Kind::Boolean},
    {"count", Kind::Integer, true, 1, max_size},
    {.name = "type", .kind = Kind::Choice, .is_required = true, .choices = "SCALAR|VEC2|VEC3|VEC4|MAT2|MAT3|MAT4|"},
    {.name = "sparse", .kind = Kind::Object, .schema = sparse},
};

constexpr Property primitive[] = {
    {.name = "attributes", .kind = Kind::Names, .is_required = true, .choices = "accessors"},
    {.name = "indices", .kind = Kind::Index, .choices = "accessors"},
    {.name = "material", .kind = Kind::Index, .choices = "materials"},
    {"mode", Kind::Integer, false, 0, 6},
    {.name = "targets", .kind = Kind::NamesList, .choices = "accessors"},
};
constexpr Property mesh[] = {
    {"name", Kind::String},
    {.name = "primitives", .kind = Kind::Objects, .is_required = true, .schema = primitive},
    {"weights", Kind::Numbers},
};

constexpr Property node_light[] = {
    {.name = "light", .kind = Kind::Index, .is_required = true, .choices = "extensions.KHR_lights_punctual.lights"}};
constexpr Property node_extensions[] = {{.name = "KHR_lights_punctual", .kind = Kind::Object, .schema = node_light}};
constexpr Property node[] = {
    {"name", Kind::String},
    {.name = "children", .kind = Kind::Indices, .choices = "nodes"},
    {.name = "matrix", .kind = Kind::Numbers, .count = 16},
    {.name = "translation", .kind = Kind::Numbers, .count = 3},
    {.name = "rotation", .kind = Kind::Numbers, .count = 4},
    {.name = "scale", .kind = Kind::Numbers, .count = 3},
    {.name = "mesh", .kind = Kind::Index, .choices = "meshes"},
    {.name = "skin", .kind = Kind::Index, .choices = "skins"},
    {.name = "camera", .kind = Kind::Index, .choices = "cameras"},
    {"weights", Kind::Numbers},
    {.name = "extensions", .kind = Kind::Object, .schema = node_extensions},
};

constexpr Property scene[] = {{.name = "nodes", .kind = Kind::Indices, .choices = "nodes"}};

constexpr Property skin[] = {
    {"name", Kind::String},
    {.name = "inverseBindMatrices", .kind = Kind::Index, .choices = "accessors"},
    {.name = "joints", .kind = Kind::Indices, .is_required = true, .choices = "nodes"},
};

constexpr Property target[] = {
    {.name = "node", .kind = Kind::Index, .choices = "nodes"},
    {.name = "path",
     .kind = Kind::Choice,
     .is_required = true,
     .choices = "translation|rotation|scale|weights|pointer|"},
};
constexpr Property channel[] = {
    {"sampler", Kind::Integer, true, 0, max_int},
    {.name = "target", .kind = Kind::Object, .is_required = true, .schema = target},
};
constexpr Property animation_sampler[] = {
    {.name = "input", .kind = Kind::Index, .is_required = true, .choices = "accessors"},
    {.name = "output", .kind = Kind::Index, .is_required = true, .choices = "accessors"},
    {.name = "interpolation", .kind = Kind::Choice, .choices = "LINEAR|STEP|CUBICSPLINE|"},
};
constexpr Property animation[] = {
    {"name", Kind::String},
    {.name = "channels", .kind = Kind::Objects, .is_required = true, .schema = channel},
    {.name = "samplers", .kind = Kind::Objects, .is_required = true, .schema = animation_sampler},
};

constexpr Property texture_transform[] = {
    {.name = "offset", .kind = Kind::Numbers, .count = 2},
    {"rotation", Kind::Number},
    {.name = "scale", .kind = Kind::Numbers, .count = 2},
    {"texCoord", Kind::Integer, false, 0, 1},
};
constexpr Property texture_use_extensions[] = {
    {.name = "KHR_texture_transform", .kind = Kind::Object, .schema = texture_transform}};
constexpr Property texture_use[] = {
    {.name = "index", .kind = Kind::Index, .is_required = true, .choices = "textures"},
    {"texCoord", Kind::Integer, false, 0, 1},
    {"scale", Kind::Number},
    {"strength", Kind::Number, false, 0, 1},
    {.name = "extensions", .kind = Kind::Object, .schema = texture_use_extensions},
};
constexpr Property metallic_roughness[] = {
    {"baseColorFactor", Kind::Numbers, false, 0, 1, 4},
    {.name = "baseColorTexture", .kind = Kind::Object, .schema = texture_use},
    {"metallicFactor", Kind::Number, false, 0, 1},
    {"roughnessFactor", Kind::Number, false, 0, 1},
    {.name = "metallicRoughnessTexture", .kind = Kind::Object, .schema = texture_use},
};
constexpr Property emissive_strength[] = {{"emissiveStrength", Kind::Number, false, 0}};
constexpr Property ior[] = {{"ior", Kind::Number, false, 0}};
constexpr Property transmission[] = {
    {"transmissionFactor", Kind::Number, false, 0, 1},
    {.name = "transmissionTexture", .kind = Kind::Object, .schema = texture_use},
};
constexpr Property material_extensions[] = {
    {.name = "KHR_materials_emissive_strength", .kind = Kind::Object, .schema = emissive_strength},
    {.name = "KHR_materials_ior", .kind = Kind::Object, .schema = ior},
    {.name = "KHR_materials_transmission", .kind = Kind::Object, .schema = transmission},
    {.name = "KHR_materials_unlit", .kind = Kind::Object},
};
constexpr Property material[] = {
    {"name", Kind::String},
    {.name = "pbrMetallicRoughness", .kind = Kind::Object, .schema = metallic_roughness},
    {.name = "normalTexture", .kind = Kind::Object, .schema = texture_use},
    {.name = "occlusionTexture", .kind = Kind::Object, .schema = texture_use},
    {.name = "emissiveTexture", .kind = Kind::Object, .schema = texture_use},
    {"emissiveFactor", Kind::Numbers, false, 0, 1, 3},
    {.name = "alphaMode", .kind = Kind::Choice, .choices = "OPAQUE|MASK|BLEND|"},
    {"alphaCutoff", Kind::Number, false, 0},
    {"doubleSided", Kind::Boolean},
    {.name = "extensions", .kind = Kind::Object, .schema = material_extensions},
};

constexpr Property image[] = {
    {"name", Kind::String},
    {"uri", Kind::String},
    {.name = "bufferView", .kind = Kind::Index, .choices = "bufferViews"},
};
constexpr Property texture[] = {
    {"name", Kind::String},
    {.name = "sampler", .kind = Kind::Index, .choices = "samplers"},
    {.name = "source", .kind = Kind::Index, .choices = "images"},
};
constexpr Property sampler[] = {
    {.name = "magFilter", .kind = Kind::Code, .choices = "9728|9729|"},
    {.name = "minFilter", .kind = Kind::Code, .choices = "9728|9729|9984|9985|9986|9987|"},
    {.name = "wrapS", .kind = Kind::Code, .choices = "10497|33071|33648|"},
    {.name = "wrapT", .kind = Kind::Code, .choices = "10497|33071|33648|"},
};

constexpr Property perspective[] = {
    {"aspectRatio", Kind::Number, false, beyond_zero},
    {"yfov", Kind::Number, true, beyond_zero, 3.1415926},
    {"znear", Kind::Number, true, beyond_zero},
    {"zfar", Kind::Number, false, beyond_zero},
};
constexpr Property orthographic[] = {
    {"xmag", Kind::Number, true},
    {"ymag", Kind::Number, true},
    {"znear", Kind::Number, true, 0},
    {"zfar", Kind::Number, true, beyond_zero},
};
constexpr Property camera[] = {
    {"name", Kind::String},
    {.name = "type", .kind = Kind::Choice, .is_required = true, .choices = "perspective|orthographic|"},
    {.name = "perspective", .kind = Kind::Object, .schema = perspective},
    {.name = "orthographic", .kind = Kind::Object, .schema = orthographic},
};

constexpr Property spot[] = {
    {"innerConeAngle", Kind::Number, false, 0, 1.5707964},
    {"outerConeAngle", Kind::Number, false, beyond_zero, 1.5707964},
};
constexpr Property light[] = {
    {"name", Kind::String},
    {.name = "type", .kind = Kind::Choice, .is_required = true, .choices = "directional|point|spot|"},
    {"color", Kind::Numbers, false, 0, FLT_MAX, 3},
    {"intensity", Kind::Number, false, 0},
    {"range", Kind::Number, false, beyond_zero},
    {.name = "spot", .kind = Kind::Object, .schema = spot},
};
constexpr Property lights[] = {{.name = "lights", .kind = Kind::Objects, .is_required = true, .schema = light}};
constexpr Property root_extensions[] = {{.name = "KHR_lights_punctual", .kind = Kind::Object, .schema = lights}};

constexpr Property root[] = {
    {.name = "asset", .kind = Kind::Object, .is_required = true, .schema = asset},
    {.name = "buffers", .kind = Kind::Objects, .schema = buffer},
    {.name = "bufferViews", .kind = Kind::Objects, .schema = buffer_view},
    {.name = "accessors", .kind = Kind::Objects, .schema = accessor},
    {.name = "meshes", .kind = Kind::Objects, .schema = mesh},
    {.name = "nodes", .kind = Kind::Objects, .schema = node},
    {.name = "scenes", .kind = Kind::Objects, .schema = scene},
    {.name = "scene", .kind = Kind::Index, .choices = "scenes"},
    {.name = "skins", .kind = Kind::Objects, .schema = skin},
    {.name = "animations", .kind = Kind::Objects, .schema = animation},
    {.name = "materials", .kind = Kind::Objects, .schema = material},
    {.name = "images", .kind = Kind::Objects, .schema = image},
    {.name = "textures", .kind = Kind::Objects, .schema = texture},
    {.name = "samplers", .kind = Kind::Objects, .schema = sampler},
    {.name = "cameras", .kind = Kind::Objects, .schema = camera},
    {.name = "extensions", .kind = Kind::Object, .schema = root_extensions},
};

constexpr const char* known_extensions[] = {
    "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_ior",     "KHR_materials_transmission",
    "KHR_materials_unlit", "KHR_mesh_quantization",           "KHR_texture_transform",
};

/// What an element takes, whatever the document says of it. tinygltf's lists grow by doubling, so there may be as much
/// in the old place, and once more in the gaps that older ones have left, as in the new one. What the scene makes of an
/// element is smaller, and comes when the gaps are free.
size_t sizeOfElement(Schema schema) {
    if (schema.data() == material) return 3 * sizeof(tinygltf::Material);
    if (schema.data() == camera) return 3 * sizeof(tinygltf::Camera);
    if (schema.data() == light) return 3 * sizeof(tinygltf::Light);
    return 3 * sizeof(tinygltf::Node);  // the largest of the others
}
static_assert(sizeof(tinygltf::Accessor) <= sizeof(tinygltf::Node) &&
              sizeof(tinygltf::Image) <= sizeof(tinygltf::Node) &&
              sizeof(tinygltf::AnimationChannel) <= sizeof(tinygltf::Node) &&
              sizeof(tinygltf::Primitive) <= sizeof(tinygltf::Node));

class Checker {
public:
    Checker(const json& document, GltfBudget& budget) : document_(document), budget_(budget) {}

    Status object(json& value, Schema schema, const GltfPath& path) {
        if (!value.is_object()) return typeError(path, "an object", value);
        for (auto entry = value.begin(); entry != value.end();) {
            const Property* property = find(schema, entry.key());
            if (!property) {
                entry = value.erase(entry);
                continue;
            }
            if (Status status = check(entry.value(), *property, path / property->name); !status) return status;
            ++entry;
        }
        for (const Property& property : schema)
            if (property.is_required && !value.contains(property.name))
                return gltfError(path, ErrorCode::Io, "gltf.missing", "'{}' is required", property.name);
        return {};
    }

private:
    static const Property* find(Schema schema, const std::string& name) {
        for (const Property& property : schema)
            if (name == property.name) return &property;
        return nullptr;
    }

    static Error typeError(const GltfPath& path, const char* wanted, const json& value) {
        return gltfError(path, ErrorCode::Io, "gltf.type", "{} is wanted, not {}", wanted,
                         value.is_structured() ? fmt::format("an {}", value.type_name()) : excerpt(value));
    }

    static std::string excerpt(const json& value) { return value.dump(-1, ' ', true).substr(0, 60); }

    Status check(json& value, const Property& property, const GltfPath& path) {
        switch (property.kind) {
            case Kind::Boolean:
                if (!value.is_boolean()) return typeError(path, "true or false", value);
                return {};
            case Kind::Integer: return integer(value, property.min, property.max, path);
            case Kind::Number: return number(value, property, path);
            case Kind::Numbers: {
                if (property.count != 0 && value.is_array() && value.size() != property.count)
                    return gltfError(path, ErrorCode::Io, "gltf.value", "{} numbers are wanted, not {}", property.count,
                                     value.size());
                return each(value, path,
                            [&](json& element, const GltfPath& place) { return number(element, property, place); });
            }
            case Kind::String:
                if (!value.is_string()) return typeError(path, "a string", value);
                return {};
            case Kind::Choice:
                if (!value.is_string()) return typeError(path, "a string", value);
                return choice(value, value.get_ref<const std::string&>(), property, path);
            case Kind::Code:
                if (Status status = integer(value, 0, max_int, path); !status) return status;
                return choice(value, value.dump(), property, path);
            case Kind::Index: return index(value, property, path);
            case Kind::Indices:
                return each(value, path,
                            [&](json& element, const GltfPath& place) { return index(element, property, place); });
            case Kind::Names: return names(value, property, path);
            case Kind::NamesList:
                return each(value, path,
                            [&](json& element, const GltfPath& place) { return names(element, property, place); });
            case Kind::Object: return object(value, property.schema, path);
            case Kind::Objects: {
                if (value.is_array())
                    if (Status status = budget_.take(path, value.size(), sizeOfElement(property.schema)); !status)
                        return status;
                return each(value, path, [&](json& element, const GltfPath& place) {
                    return object(element, property.schema, place);
                });
            }
        }
        return {};
    }

    template <class Visit>
    static Status each(json& value, const GltfPath& path, Visit&& visit) {
        if (!value.is_array()) return typeError(path, "an array", value);
        for (size_t i = 0; i < value.size(); i++)
            if (Status status = visit(value[i], path / i); !status) return status;
        return {};
    }

    static Status integer(json& value, double min, double max, const GltfPath& path) {
        if (value.is_number_float()) {
            const double number = value.get<double>();
            if (number == std::floor(number) && std::fabs(number) <= max_size) value = static_cast<int64_t>(number);
        }
        if (!value.is_number_integer()) return typeError(path, "an integer", value);
        const auto number = value.get<double>();
        if (number < min || number > max)
            return gltfError(path, ErrorCode::Io, "gltf.value", "{} is not in {:.0f} to {:.0f}", excerpt(value), min,
                             max);
        // tinygltf wants sizes as unsigned numbers.
        if (number >= 0.0) value = static_cast<uint64_t>(number);
        return {};
    }

    static Status number(const json& value, const Property& property, const GltfPath& path) {
        if (!value.is_number()) return typeError(path, "a number", value);
        const auto number = value.get<double>();
        if (!(number >= property.min && number <= property.max))
            return gltfError(path, ErrorCode::Io, "gltf.value", "{} is not in {:g} to {:g}", excerpt(value),
                             property.min, property.max);
        return {};
    }

    static Status choice(const json& value, const std::string& word, const Property& property, const GltfPath& path) {
        const std::string_view choices = property.choices;
        const size_t at = ("|" + std::string(choices)).find("|" + word + "|");
        if (word.find('|') == std::string::npos && at != std::string::npos) return {};
        return gltfError(path, ErrorCode::Io, "gltf.value", "{} is none of {}", excerpt(value),
                         choices.substr(0, choices.size() - 1));
    }

    Status index(json& value, const Property& property, const GltfPath& path) {
        if (Status status = integer(value, -max_size, max_size, path); !status) return status;
        const uint64_t count = countOf(property.choices);
        if (!value.is_number_unsigned() || value.get<uint64_t>() >= count)
            return gltfError(path, ErrorCode::Io, "gltf.index", "{} names none of the {} {}", excerpt(value), count,
                             property.choices);
        return {};
    }

    Status names(json& value, const Property& property, const GltfPath& path) {
        if (!value.is_object()) return typeError(path, "an object", value);
        for (auto entry = value.begin(); entry != value.end(); ++entry)
            if (Status status = index(entry.value(), property, path / std::string_view(entry.key())); !status)
                return status;
        return {};
    }

    uint64_t countOf(std::string_view array) const {
        const json* value = &document_;
        for (size_t begin = 0; begin < array.size();) {
            const size_t end = std::min(array.find('.', begin), array.size());
            const auto entry =
                value->is_object() ? value->find(std::string(array.substr(begin, end - begin))) : value->end();
            if (entry == value->end()) return 0;
            value = &*entry;
            begin = end + 1;
        }
        return value->is_array() ? value->size() : 0;
    }

    const json& document_;
    GltfBudget& budget_;
};

Status checkExtensions(json& document) {
    const auto required = document.find("extensionsRequired");
    if (required == document.end()) return {};
    const GltfPath path;
    const GltfPath place = path / "extensionsRequired";
    if (!required->is_array())
        return gltfError(place, ErrorCode::Io, "gltf.type", "an array is wanted, not {}", required->type_name());
    for (size_t i = 0; i < required->size(); i++) {
        const json& name = (*required)[i];
        if (!name.is_string())
            return gltfError(place / i, ErrorCode::Io, "gltf.type", "a string is wanted, not {}", name.type_name());
        const auto& text = name.get_ref<const std::string&>();
        if (std::find(std::begin(known_extensions), std::end(known_extensions), text) == std::end(known_extensions))
            return gltfError(place / i, ErrorCode::Unsupported, "gltf.extension",
                             "the document cannot be read without the extension '{}'", text.substr(0, 100));
    }
    document.erase(required);
    return {};
}

Status checkVersion(const json& asset_value) {
    const std::string version = asset_value["version"].get<std::string>();
    const std::string least = asset_value.value("minVersion", version.substr(0, 2) == "2." ? "2.0" : version);
    if (version.substr(0, 2) != "2." || least != "2.0")
        return gltfError(GltfPath(), ErrorCode::Unsupported, "gltf.version",
                         "the document is of version '{}' and asks for a reader of '{}'; this one reads 2.0",
                         version.substr(0, 20), least.substr(0, 20));
    return {};
}

/// What belongs together.
Status checkCombinations(json& document) {
    const GltfPath path;
    const auto visit = [&](const char* array, auto&& check) -> Status {
        const auto elements = document.find(array);
        if (elements == document.end()) return {};
        const GltfPath place = path / array;
        for (size_t i = 0; i < elements->size(); i++)
            if (Status status = check((*elements)[i], place / i); !status) return status;
        return {};
    };
    if (Status status = visit("cameras",
                              [](const json& camera_value, const GltfPath& place) -> Status {
                                  const auto type = camera_value["type"].get<std::string>();
                                  if (camera_value.contains(type)) return {};
                                  return gltfError(place, ErrorCode::Io, "gltf.missing", "'{}' is required", type);
                              });
        !status)
        return status;
    if (Status status = visit("images",
                              [](const json& image_value, const GltfPath& place) -> Status {
                                  if (image_value.contains("uri") != image_value.contains("bufferView")) return {};
                                  return gltfError(place, ErrorCode::Io, "gltf.missing",
                                                   "either 'uri' or 'bufferView' is required");
                              });
        !status)
        return status;
    if (Status status = visit("bufferViews",
                              [](const json& view, const GltfPath& place) -> Status {
                                  const auto stride = view.value("byteStride", uint64_t{4});
                                  if (stride % 4 == 0) return {};
                                  return gltfError(place, ErrorCode::Io, "gltf.stride",
                                                   "a stride of {} bytes is no multiple of 4", stride);
                              });
        !status)
        return status;
    // tinygltf leaves out channels without a node, so that the others would change their numbers.
    if (const auto animations = document.find("animations"); animations != document.end())
        for (json& animation_value : *animations)
            for (json& channel_value : animation_value["channels"])
                if (json& target_value = channel_value["target"]; !target_value.contains("node"))
                    target_value = {{"node", 0}, {"path", "pointer"}};
    // tinygltf wants the angles of a spot, all of which have defaults.
    if (const auto extensions = document.find("extensions"); extensions != document.end())
        if (const auto punctual = extensions->find("KHR_lights_punctual"); punctual != extensions->end())
            for (json& light_value : (*punctual)["lights"])
                if (light_value["type"] == "spot" && !light_value.contains("spot"))
                    light_value["spot"] = json::object();
    return {};
}

}  // namespace

std::string GltfPath::text() const {
    if (!parent) return {};
    const std::string before = parent->text();
    if (name.empty()) return fmt::format("{}[{}]", before, index);
    return before.empty() ? std::string(name.substr(0, 60)) : fmt::format("{}.{}", before, name.substr(0, 60));
}

Status checkGltf(json& document, GltfBudget& budget) {
    if (!document.is_object())
        return gltfError(GltfPath(), ErrorCode::Io, "gltf.type", "the document is no object but {}",
                         document.type_name());
    if (Status status = checkExtensions(document); !status) return status;
    // The version first: documents of glTF 1.0 break every rule of 2.0.
    const GltfPath path;
    if (const auto entry = document.find("asset"); entry != document.end()) {
        if (Status status = Checker(document, budget).object(*entry, asset, path / "asset"); !status) return status;
        if (Status status = checkVersion(*entry); !status) return status;
    }
    if (Status status = Checker(document, budget).object(document, root, path); !status) return status;
    return checkCombinations(document);
}

}  // namespace glint::detail
