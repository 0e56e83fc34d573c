#include <glint/graphics/scene_model.h>

#include <glint/base/format_error.h>
#include <glint/geometry/tangents.h>

#include <algorithm>
#include <new>

namespace glint {

namespace {

constexpr size_t floats_per_target = 9;
const SceneMaterial no_material;

const SceneMaterial& materialOf(const Scene& scene, uint32_t material) {
    return material == scene_none ? no_material : scene.materials[material];
}

bool wantsTangents(const SceneModel::Layout& layout) {
    return std::ranges::find(layout, Pipeline::AttributeTangent, &Pipeline::VertexAttribute::attribute) != layout.end();
}

/// The mesh as it is laid out: with tangents where a normal map is read with them.
Expected<SceneMesh> prepared(const Scene& scene, uint32_t index, bool with_tangents) {
    SceneMesh mesh = scene.meshes[index];
    for (ScenePrimitive& primitive : mesh.primitives) {
        const SceneTextureUse& map = materialOf(scene, primitive.material).normal_texture;
        if (!with_tangents || map.texture == scene_none || !primitive.tangents.empty() || primitive.indices.empty() ||
            primitive.normals.empty() || primitive.texcoords[map.texcoord].empty())
            continue;
        if (Status status = createTangents(primitive, map.texcoord); !status) return unexpected(status.error());
    }
    return mesh;
}

/// The records of a mesh's targets: all vertices of the first, then of the second.
void appendTargets(const SceneMesh& mesh, std::vector<float>& records) {
    for (size_t k = 0; k < mesh.weights.size(); k++)
        for (const ScenePrimitive& primitive : mesh.primitives) {
            const SceneMorphTarget& target = primitive.targets[k];
            for (size_t i = 0; i < primitive.positions.size(); i++)
                for (const std::vector<Vector3f>* values : {&target.positions, &target.normals, &target.tangents}) {
                    const Vector3f value = values->empty() ? Vector3f(0.0f) : (*values)[i];
                    records.insert(records.end(), {value.x, value.y, value.z});
                }
        }
}

/// Of 8 bits and four channels, with the gray of images that have no colours in three.
Expected<Image> rgba(const Image& image) {
    Expected<Image> result = image.convert(FormatRGBAu8n);
    const size_t channels = formatInfo(image.format()).components;
    if (!result || channels > 2) return result;
    for (uint32_t y = 0; y < image.height(); y++)
        for (uint32_t x = 0; x < image.width(); x++) {
            const Vector4f texel = image.load(x, y);
            result->store(x, y, {texel.x, texel.x, texel.x, channels == 2 ? texel.y : 1.0f});
        }
    return result;
}

SamplerDesc describe(const SceneTexture& texture) {
    SamplerDesc desc;
    const bool is_linear = texture.min_filter == SceneFilter::Linear;
    if (!texture.mip_filter)
        desc.filter = texture.mag_filter == SceneFilter::Linear ? Sampler::FilterLinear : Sampler::FilterPoint;
    else if (is_linear)
        desc.filter = *texture.mip_filter == SceneFilter::Linear ? Sampler::FilterTrilinear : Sampler::FilterBilinear;
    else
        desc.filter = Sampler::FilterBipoint;
    switch (texture.wrap[0]) {
        case SceneWrap::Repeat: desc.wrap = Sampler::WrapModeRepeat; break;
        case SceneWrap::Mirror: desc.wrap = Sampler::WrapModeMirror; break;
        case SceneWrap::Clamp: desc.wrap = Sampler::WrapModeClamp; break;
    }
    return desc;
}

}  // namespace

SceneModel::SceneModel(const Device& device, const Pipeline& pipeline, const Scene& scene, std::string_view name,
                       Where where) {
    (void)create(device, pipeline, scene, name, where);
}

SceneModel::SceneModel(const Device& device, const Layout& layout, const Scene& scene, std::string_view name,
                       Where where) {
    (void)create(device, layout, scene, name, where);
}

Status SceneModel::create(const Device& device, const Pipeline& pipeline, const Scene& scene, std::string_view name,
                          Where where) {
    const ObjectState state = pipeline.state();
    if (state != ObjectState::Null && state != ObjectState::Failed)
        return create(device, pipeline.getAttributes(), scene, name, where);
    *this = {};
    device_ = device;
    return fail(pipeline.error().at(where));
}

Status SceneModel::create(const Device& device, const Layout& layout, const Scene& scene, std::string_view name,
                          Where where) {
    *this = {};
    device_ = device;
    name_ = name;
    if (!device) return fail(device.error().at(where));
    try {
        // What the device refuses it has told of itself.
        error_ = build(layout, scene, where);
        if (!error_) return setPose(scene.pose(), where);
        return error_;
    } catch (const std::bad_alloc&) {
        return fail(makeError(where, ErrorCode::OutOfMemory, "model.out_of_memory",
                              "{}: memory for a scene of {} meshes and {} images ran out", name_, scene.meshes.size(),
                              scene.images.size()));
    }
}

Error SceneModel::build(const Layout& layout, const Scene& scene, Where where) {
    const auto refused = [&](const Error& error) {
        device_.report(error.named(name_).at(where));
        return error.named(name_).at(where);
    };
    if (Status status = scene.validate(); !status) return refused(status.error());
    findItems(scene);
    if (items_.empty())
        return refused(makeError(ErrorCode::InvalidArgument, "model.no_items", "no shown node has triangles"));
    if (Error error = uploadMeshes(layout, scene, where)) return error;
    if (Error error = uploadTextures(scene, where)) return error;
    transforms_ = device_.createBuffer(Buffer::FlagStorage, transform_count_ * sizeof(Transform3x4),
                                       name_ + " transforms", where);
    weights_ = device_.createBuffer(Buffer::FlagStorage, std::max<uint64_t>(weight_count_, 4) * sizeof(float),
                                    name_ + " weights", where);
    for (const Buffer& buffer : {transforms_, weights_})
        if (!buffer) return buffer.error();
    return {};
}

void SceneModel::findItems(const Scene& scene) {
    skins_ = scene.skins;
    weight_counts_.resize(scene.nodes.size(), 0);
    const auto place = [&](std::map<uint32_t, uint32_t>& places, uint32_t key, uint64_t& count, size_t size) {
        const auto [found, is_new] = places.try_emplace(key, static_cast<uint32_t>(count));
        if (is_new) count += size;
        return found->second;
    };
    std::vector<uint32_t> open(scene.roots.rbegin(), scene.roots.rend());
    while (!open.empty()) {
        const uint32_t index = open.back();
        open.pop_back();
        const SceneNode& node = scene.nodes[index];
        open.insert(open.end(), node.children.rbegin(), node.children.rend());
        if (node.mesh == scene_none) continue;
        const SceneMesh& mesh = scene.meshes[node.mesh];
        weight_counts_[index] = mesh.weights.size();
        for (uint32_t i = 0; i < mesh.primitives.size(); i++) {
            const ScenePrimitive& primitive = mesh.primitives[i];
            if (primitive.indices.empty()) continue;
            Item& item = items_.emplace_back();
            item.node = index;
            item.mesh = node.mesh;
            item.primitive = i;
            item.material = primitive.material;
            const bool is_skinned = node.skin != scene_none && !primitive.joints.empty();
            item.vertices.joint_step = is_skinned ? 1 : 0;
            item.vertices.first_transform =
                is_skinned ? place(skin_places_, node.skin, transform_count_, scene.skins[node.skin].joints.size())
                           : place(node_places_, index, transform_count_, 1);
            item.vertices.targets = static_cast<uint32_t>(mesh.weights.size());
            if (!mesh.weights.empty())
                item.vertices.first_weight = place(weight_places_, index, weight_count_, mesh.weights.size());
            triangles_ += primitive.indices.size() / 3;
        }
    }
    for (const auto& [skin, first] : skin_places_) joints_ += static_cast<uint32_t>(scene.skins[skin].joints.size());
    std::stable_partition(items_.begin(), items_.end(), [&](const Item& item) {
        return materialOf(scene, item.material).alpha != SceneAlpha::Blend;
    });
}

Error SceneModel::uploadMeshes(const Layout& layout, const Scene& scene, Where where) {
    const bool with_tangents = wantsTangents(layout);
    std::vector<float> targets;
    std::map<uint32_t, uint32_t> first_targets;
    for (Item& item : items_) {
        MeshModel& model = models_[item.mesh];
        if (!model) {
            const Expected<SceneMesh> mesh = prepared(scene, item.mesh, with_tangents);
            if (!mesh) {
                device_.report(mesh.error().named(name_).at(where));
                return mesh.error().named(name_).at(where);
            }
            model.setName(mesh->name.empty() ? name_ : mesh->name);
            if (Status status = model.create(device_, layout, *mesh, MeshModel::FlagNone, where); !status)
                return status.error();
            first_targets[item.mesh] = static_cast<uint32_t>(targets.size() / floats_per_target);
            appendTargets(*mesh, targets);
        }
        item.vertices.first_target = first_targets[item.mesh];
        item.vertices.count = model.getVertices();
    }
    targets.resize(std::max<size_t>(targets.size(), 4));
    targets_ = device_.createBuffer(Buffer::FlagStorage, std::span(targets), name_ + " targets", where);
    return targets_ ? Error() : targets_.error();
}

Error SceneModel::uploadTextures(const Scene& scene, Where where) {
    // There are many textures and few ways to read one, and devices have few samplers.
    std::map<std::pair<Sampler::Filter, Sampler::WrapMode>, Sampler> known;
    const auto samplerOf = [&](const SceneTexture& texture) {
        const SamplerDesc desc = describe(texture);
        Sampler& made = known[{desc.filter, desc.wrap}];
        if (!made) made = device_.createSampler(desc, name_, where);
        return made;
    };
    for (const SceneTexture& texture : scene.textures) {
        images_.push_back(texture.image);
        samplers_.push_back(samplerOf(texture));
    }
    samplers_.push_back(samplerOf({}));
    for (const Sampler& sampler : samplers_)
        if (!sampler) return sampler.error();
    for (const Item& item : items_) {
        const SceneMaterial& material = materialOf(scene, item.material);
        const std::pair<const SceneTextureUse*, bool> uses[] = {
            {&material.base_color_texture, true}, {&material.emission_texture, true},
            {&material.normal_texture, false},    {&material.metallic_roughness_texture, false},
            {&material.occlusion_texture, false}, {&material.transmission_texture, false}};
        for (const auto& [use, is_color] : uses)
            if (Error error = uploadTexture(scene, *use, is_color, where)) return error;
    }
    return {};
}

Error SceneModel::uploadTexture(const Scene& scene, const SceneTextureUse& use, bool is_color, Where where) {
    if (use.texture == scene_none || images_[use.texture] == scene_none) return {};
    const uint32_t index = images_[use.texture];
    const SceneImage& source = scene.images[index];
    // Without images the file was read for its shapes.
    if (source.image.width() == 0 || textures_.contains({index, is_color})) return {};
    const Expected<Image> image = rgba(source.image);
    if (!image) {
        device_.report(image.error().named(source.name).at(where));
        return image.error().named(source.name).at(where);
    }
    const Texture texture = device_.createTexture2D(is_color ? FormatRGBAu8ns : FormatRGBAu8n, image->width(),
                                                    image->height(), Texture::FlagMipmaps, source.name, where);
    if (!texture) return texture.error();
    device_.setTexture(texture, image->bytes().data(), image->bytes().size(), Slice{}, Region{}, where);
    device_.createMipmaps(texture, where);
    for (uint32_t mip = 0; mip < texture.getMipmaps(); mip++) texture_size_ += texture.getDataSize(mip);
    textures_[{index, is_color}] = texture;
    return {};
}

Status SceneModel::setPose(const ScenePose& pose, Where where) {
    if (!*this) return error().at(where);
    const auto refused = [&](const Error& error) {
        device_.report(error);
        return error;
    };
    if (pose.world.size() != weight_counts_.size() || pose.weights.size() != weight_counts_.size())
        return refused(makeError(where, ErrorCode::InvalidArgument, "model.pose",
                                 "{}: a pose of {} nodes for a scene of {}", name_, pose.world.size(),
                                 weight_counts_.size()));
    std::vector<Transform3x4> transforms(transform_count_);
    for (const auto& [skin, first] : skin_places_)
        for (size_t i = 0; i < skins_[skin].joints.size(); i++)
            transforms[first + i] = Transform3x4(pose.world[skins_[skin].joints[i]] * skins_[skin].inverse_bind[i]);
    for (const auto& [node, place] : node_places_) transforms[place] = Transform3x4(pose.world[node]);
    std::vector<float> weights(weight_count_);
    for (const auto& [node, first] : weight_places_) {
        const std::vector<float>& values = pose.weights[node];
        if (values.size() != weight_counts_[node])
            return refused(makeError(where, ErrorCode::InvalidArgument, "model.pose",
                                     "{}: {} weights of node {} for {} morph targets", name_, values.size(), node,
                                     weight_counts_[node]));
        std::copy(values.begin(), values.end(), weights.begin() + first);
    }
    device_.setBuffer(transforms_, std::span(transforms), where);
    if (!weights.empty()) device_.setBuffer(weights_, std::span(weights), where);
    return {};
}

void SceneModel::draw(Command& command, const Item& item, Where where) const {
    if (!*this) return command.fail(error().at(where));
    const auto model = models_.find(item.mesh);
    if (model == models_.end())
        return command.fail(
            makeError(where, ErrorCode::OutOfRange, "model.item", "draw: {} has no mesh {}", name_, item.mesh));
    model->second.draw(command, item.primitive, 1, where);
}

const Texture& SceneModel::getTexture(const SceneTextureUse& use, bool is_color) const {
    static const Texture none;
    if (use.texture >= images_.size()) return none;
    const auto found = textures_.find({images_[use.texture], is_color});
    return found == textures_.end() ? none : found->second;
}

const Sampler& SceneModel::getSampler(const SceneTextureUse& use) const {
    static const Sampler none;
    return samplers_.empty() ? none : samplers_[std::min<size_t>(use.texture, samplers_.size() - 1)];
}

Status SceneModel::fail(const Error& error) {
    error_ = error;
    device_.report(error);
    return error;
}

}  // namespace glint
