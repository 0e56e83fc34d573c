#include <glint/format/detail/gltf_scene.h>

namespace glint::detail {

namespace {

using tinygltf::Value;

float number(const Value& object, const char* name, float fallback) {
    return object.Has(name) ? static_cast<float>(object.Get(name).GetNumberAsDouble()) : fallback;
}

Vector2f pair(const Value& object, const char* name, const Vector2f& fallback) {
    if (!object.Has(name)) return fallback;
    const Value& values = object.Get(name);
    return {static_cast<float>(values.Get(0).GetNumberAsDouble()),
            static_cast<float>(values.Get(1).GetNumberAsDouble())};
}

void applyTransform(SceneTextureUse& use, const Value& transform) {
    use.offset = pair(transform, "offset", use.offset);
    use.rotation = number(transform, "rotation", use.rotation);
    use.scale = pair(transform, "scale", use.scale);
    if (transform.Has("texCoord")) use.texcoord = static_cast<uint32_t>(transform.Get("texCoord").GetNumberAsInt());
}

template <class Info>
SceneTextureUse textureUse(const Info& info) {
    SceneTextureUse use;
    if (info.index < 0) return use;
    use.texture = static_cast<uint32_t>(info.index);
    use.texcoord = static_cast<uint32_t>(info.texCoord);
    if (const auto found = info.extensions.find("KHR_texture_transform"); found != info.extensions.end())
        applyTransform(use, found->second);
    return use;
}

/// The same of a texture within an extension, which tinygltf leaves as it is.
SceneTextureUse textureUse(const Value& info) {
    SceneTextureUse use;
    use.texture = static_cast<uint32_t>(info.Get("index").GetNumberAsInt());
    if (info.Has("texCoord")) use.texcoord = static_cast<uint32_t>(info.Get("texCoord").GetNumberAsInt());
    if (info.Has("extensions"))
        if (const Value& extensions = info.Get("extensions"); extensions.Has("KHR_texture_transform"))
            applyTransform(use, extensions.Get("KHR_texture_transform"));
    return use;
}

}  // namespace

Expected<SceneMaterial> makeGltfMaterial(const tinygltf::Material& source, const GltfPath& path) {
    const tinygltf::PbrMetallicRoughness& surface = source.pbrMetallicRoughness;
    SceneMaterial material;
    material.name = source.name;
    for (int i = 0; i < 4; i++)
        material.base_color[i] = static_cast<float>(surface.baseColorFactor[static_cast<size_t>(i)]);
    material.base_color_texture = textureUse(surface.baseColorTexture);
    material.metallic = static_cast<float>(surface.metallicFactor);
    material.roughness = static_cast<float>(surface.roughnessFactor);
    material.metallic_roughness_texture = textureUse(surface.metallicRoughnessTexture);
    material.normal_texture = textureUse(source.normalTexture);
    material.normal_scale = static_cast<float>(source.normalTexture.scale);
    material.occlusion_texture = textureUse(source.occlusionTexture);
    material.occlusion_strength = static_cast<float>(source.occlusionTexture.strength);
    for (int i = 0; i < 3; i++)
        material.emission[i] = static_cast<float>(source.emissiveFactor[static_cast<size_t>(i)]);
    material.emission_texture = textureUse(source.emissiveTexture);
    if (source.alphaMode == "MASK") material.alpha = SceneAlpha::Mask;
    if (source.alphaMode == "BLEND") material.alpha = SceneAlpha::Blend;
    material.alpha_cutoff = static_cast<float>(source.alphaCutoff);
    material.is_double_sided = source.doubleSided;

    for (const auto& [name, value] : source.extensions) {
        if (name == "KHR_materials_emissive_strength") {
            material.emission *= number(value, "emissiveStrength", 1.0f);
        } else if (name == "KHR_materials_ior") {
            material.ior = number(value, "ior", material.ior);
            if (material.ior > 0.0f && material.ior < 1.0f)
                return unexpected(gltfError(path / "extensions.KHR_materials_ior", ErrorCode::Io, "gltf.value",
                                            "the index of refraction is {}: at least 1, or 0", material.ior));
        } else if (name == "KHR_materials_transmission") {
            material.transmission = number(value, "transmissionFactor", 0.0f);
            if (value.Has("transmissionTexture"))
                material.transmission_texture = textureUse(value.Get("transmissionTexture"));
        } else if (name == "KHR_materials_unlit") {
            material.is_unlit = true;
        }
    }
    return material;
}

}  // namespace glint::detail
