// A skinned, textured, animated model: joints are posed on the host, vertices follow them in the vertex shader.

#include "01_hello_usdz/koi.h"
#include "common/viewer.h"

#include <glint/graphics/scene_model.h>
#include <glint/math/bounds.h>
#include <glint/math/camera.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

using namespace glint;

namespace {

// As main.shader has them.

struct Use {
    Vector4f rows = {1, 0, 0, 1};
    Vector2f offset = {0, 0};
    uint32_t texcoord = 0;
    uint32_t is_used = 0;
};

struct Material {
    Vector4f base_color;
    Vector3f emission;
    float alpha_cutoff;
    float metallic, roughness, normal_scale, occlusion_strength;
    uint32_t alpha, is_unlit;
    Vector2u padding = {0, 0};
    Use color_use, surface_use, normal_use, occlusion_use, emission_use;
};
static_assert(sizeof(Material) == 224);

constexpr uint32_t stride = 88;
const SceneModel::Layout layout = {{Pipeline::AttributePosition, FormatRGBf32, 0, 0, stride},
                                   {Pipeline::AttributeNormal, FormatRGBf32, 0, 12, stride},
                                   {Pipeline::AttributeTangent, FormatRGBAi16n, 0, 24, stride},
                                   {Pipeline::AttributeTexCoord, FormatRGf32, 0, 32, stride},
                                   {Pipeline::AttributeTexCoord, FormatRGf32, 0, 40, stride},
                                   {Pipeline::AttributeColor, FormatRGBAf32, 0, 48, stride},
                                   {Pipeline::AttributeJoints, FormatRGBAu16, 0, 64, stride},
                                   {Pipeline::AttributeWeights, FormatRGBAf32, 0, 72, stride}};

Pipeline makePipeline(Device& device, uint32_t samples, bool blends) {
    Pipeline pipeline = device.createPipeline(blends ? "blended" : "opaque");
    for (const Pipeline::VertexAttribute& a : layout)
        pipeline.addAttribute(a.attribute, a.format, a.buffer, a.offset, a.stride);
    pipeline.setColorFormat(FormatRGBAf16);
    pipeline.setDepthFormat(FormatDf32);
    pipeline.setDepthFunc(Pipeline::DepthFuncGreater);
    pipeline.setMultisample(samples);
    if (blends) {
        pipeline.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncInvSrcAlpha);
        pipeline.setDepthMask(false);
    }
    pipeline.loadShaderGLSL(Shader::TypeVertex, EXAMPLE_DIR "/main.shader", "VERTEX_SHADER=1");
    pipeline.loadShaderGLSL(Shader::TypeFragment, EXAMPLE_DIR "/main.shader", "FRAGMENT_SHADER=1");
    (void)pipeline.create();  // carried by the handle
    return pipeline;
}

/// What a part of a material reads, bound where the shader expects it.
class Binder {
public:
    Binder(Command& command, const SceneModel& model, const Texture& none)
        : command_(command), model_(model), none_(none) {}

    Use bind(uint32_t slot, const SceneTextureUse& from, bool is_color) {
        const Texture& texture = model_.getTexture(from, is_color);
        command_.setTexture(slot, texture ? texture : none_);
        command_.setSampler(slot, model_.getSampler(from));
        const float c = std::cos(from.rotation), s = std::sin(from.rotation);
        return {{c * from.scale.x, s * from.scale.y, -s * from.scale.x, c * from.scale.y},
                from.offset,
                from.texcoord,
                texture ? 1u : 0u};
    }

private:
    Command& command_;
    const SceneModel& model_;
    const Texture& none_;
};

void bindMaterial(Command& command, const SceneModel& model, const SceneMaterial& from, const Texture& none) {
    Binder binder(command, model, none);
    const Material material = {.base_color = from.base_color,
                               .emission = from.emission,
                               .alpha_cutoff = from.alpha_cutoff,
                               .metallic = from.metallic,
                               .roughness = from.roughness,
                               .normal_scale = from.normal_scale,
                               .occlusion_strength = from.occlusion_strength,
                               .alpha = static_cast<uint32_t>(from.alpha),
                               .is_unlit = from.is_unlit ? 1u : 0u,
                               .color_use = binder.bind(0, from.base_color_texture, true),
                               .surface_use = binder.bind(1, from.metallic_roughness_texture, false),
                               .normal_use = binder.bind(2, from.normal_texture, false),
                               .occlusion_use = binder.bind(3, from.occlusion_texture, false),
                               .emission_use = binder.bind(4, from.emission_texture, true)};
    command.setUniform(1, material);
}

/// The box of the scene over its animation, of a few moments.
Expected<BoundBox> boundsOf(const Scene& scene, uint32_t animation) {
    BoundBox box;
    const float duration = animation < scene.animations.size() ? scene.animations[animation].duration() : 0.0f;
    constexpr int moments = 4;
    for (int i = 0; i < (duration > 0.0f ? moments : 1); i++) {
        const Expected<Mesh> mesh = scene.mesh(scene.pose(animation, duration * static_cast<float>(i) / moments));
        if (!mesh) return unexpected(mesh.error());
        box.add(mesh->bounds());
    }
    return box;
}

/// A vector of the examples' world, with Z up, as glTF has it, with Y up.
Vector3f toScene(const Vector3f& v) { return {v.x, v.z, -v.y}; }

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Shows a skinned, textured, animated model.");
    std::filesystem::path path;
    uint32_t animation = 0, samples = 4;
    bool is_at_rest = false;
    example.add("--mesh", path, "Model to show (.gltf, .glb); three koi without it");
    example.add("--animation", animation, "Which of the model's animations");
    example.addKnob("--rest", is_at_rest, "Show the model at rest");
    example.addKnob("--samples", samples, 1, 8, "Samples a pixel: 1, 2, 4 or 8");
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<Scene> scene = path.empty() ? Expected<Scene>(makeKoi()) : Scene::load(path);
    if (!scene) return report(scene.error());
    if (animation > 0 && animation >= scene->animations.size())
        return report(Error(ErrorCode::OutOfRange, "example.animation",
                            "--animation " + std::to_string(animation) + ": the model has " +
                                std::to_string(scene->animations.size())));
    const float duration = scene->animations.empty() ? 0.0f : scene->animations[animation].duration();
    const Expected<BoundBox> bounds = boundsOf(*scene, animation);
    if (!bounds) return report(bounds.error());

    Device device = openDevice(example);
    if (!device) return report(device.error());
    SceneModel model(device, layout, *scene, example.name());
    if (!model) return report(model.error());
    Kernel tone = device.createKernel("tone");
    tone.loadShaderGLSL(EXAMPLE_DIR "/main.shader", "TONE_SHADER=1");
    if (!tone.create()) return report(tone.error());
    // For what a material does not read.
    const Texture none = device.createTexture2D(FormatRGBAu8n, 1, 1, 0, "none");

    const Vector3f centre = bounds->center();
    const float radius = std::max(0.5f * glm::length(bounds->size()), 1e-6f);
    const SceneMaterial plain;
    Pipeline opaque, blended;
    Texture light;
    Target target;
    uint32_t made_samples = 0;

    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) -> Status {
        const uint32_t wanted = samples >= 8 ? 8u : samples >= 4 ? 4u : samples >= 2 ? 2u : 1u;
        if (wanted != made_samples) {
            opaque = makePipeline(device, wanted, false);
            blended = makePipeline(device, wanted, true);
            for (const Pipeline& pipeline : {opaque, blended})
                if (!pipeline) return pipeline.error();
        }
        if (frame.is_resized || wanted != made_samples) {
            made_samples = wanted;
            const Texture::Flags many = wanted == 8   ? Texture::FlagMultisample8
                                        : wanted == 4 ? Texture::FlagMultisample4
                                        : wanted == 2 ? Texture::FlagMultisample2
                                                      : Texture::FlagNone;
            const Texture depth =
                device.createTexture2D(FormatDf32, frame.width, frame.height, Texture::FlagTarget | many, "depth");
            light = device.createTexture2D(FormatRGBAf16, frame.width, frame.height, Texture::FlagTarget, "light");
            target = device.createTarget(light, depth);
            if (wanted > 1) {
                target.setColorTexture(0, device.createTexture2D(FormatRGBAf16, frame.width, frame.height,
                                                                 Texture::FlagTarget | many, "samples"));
                target.setColorResolve(0, light);
                target.setColorOperation(0, Target::BeginClear | Target::EndDiscard);
            }
            target.setDepthOperation(Target::BeginClear | Target::EndDiscard);
            target.setClearDepth(0.0f);
            target.setClearColor({0.0f, 0.0f, 0.0f, 0.0f});
        }

        const float time = duration > 0.0f ? std::fmod(static_cast<float>(frame.time), duration) : 0.0f;
        if (Status posed = model.setPose(is_at_rest ? scene->pose() : scene->pose(animation, time)); !posed)
            return posed;

        // Koi are seen from above, a model of a file from before it.
        const Vector3f way = path.empty() ? Vector3f(0.05f, -0.6f, 1.05f) : Vector3f(0.7f, -1.7f, 0.6f);
        const Vector3f to = path.empty() ? Vector3f(0.0f, -0.1f, 0.0f) * radius : Vector3f(0.0f);
        const Vector3f from = frame.view.eye(way * radius, to);
        const Camera camera = Camera()
                                  .lookAt(centre + toScene(from), centre + toScene(to), {0, 1, 0})
                                  .perspective(60.0f, frame.aspect(), radius * 1e-2f);
        Command command = device.createCommand(target);
        frame.timer.begin(command, "draw");
        command.setUniform(0, camera.parameters());
        command.setStorageBuffers(0, {model.getTransforms(), model.getWeights(), model.getTargets()});
        for (const SceneModel::Item& item : model.getItems()) {
            const SceneMaterial& material = item.material == scene_none ? plain : scene->materials[item.material];
            command.setPipeline(material.alpha == SceneAlpha::Blend ? blended : opaque);
            command.setPushConstants(item.vertices);
            bindMaterial(command, model, material, none);
            model.draw(command, item);
        }
        frame.timer.end(command);

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "tone");
        compute.setKernel(tone);
        compute.setTexture(0, light);
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit({command, compute});
    });
    if (!status) return report(status.error());

    Statistics& statistics = example.statistics();
    statistics.counts = {{"triangles", model.getTriangles()},
                         {"draws", model.getItems().size()},
                         {"joints", model.getJoints()},
                         {"animations", scene->animations.size()},
                         {"texture_bytes", model.getTextureSize()},
                         {"samples", made_samples}};
    std::printf("%llu triangles in %zu draws, %u joints, %.1f s of animation, %.1f MB of textures; %.1f ms to draw\n",
                static_cast<unsigned long long>(model.getTriangles()), model.getItems().size(), model.getJoints(),
                static_cast<double>(duration), static_cast<double>(model.getTextureSize()) * 1e-6,
                statistics.median("draw") * 1e-6);
    return viewer.finish();
}
