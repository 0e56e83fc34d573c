#include "11_hello_bindless/hall.h"

#include <algorithm>
#include <cmath>
#include <functional>

using namespace glint;

namespace {

constexpr uint32_t image_size = 256;

// Patterns. Places are in [0, 1) of an image, which repeats.

float randomAt(uint32_t x, uint32_t y, uint32_t seed) {
    uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h = (h ^ (h >> 16)) * 0x7feb352du;
    h = (h ^ (h >> 15)) * 0x846ca68bu;
    return static_cast<float>((h ^ (h >> 16)) >> 8) * 0x1p-24f;
}

/// Smooth values in [0, 1] with `cells` cells along a side.
float noise(Vector2f place, uint32_t cells, uint32_t seed) {
    const float x = place.x * static_cast<float>(cells), y = place.y * static_cast<float>(cells);
    const float fx = std::floor(x), fy = std::floor(y);
    const auto ix = static_cast<uint32_t>(static_cast<int32_t>(fx)),
               iy = static_cast<uint32_t>(static_cast<int32_t>(fy));
    const auto ease = [](float t) { return t * t * (3 - 2 * t); };
    const auto corner = [&](uint32_t dx, uint32_t dy) {
        return randomAt((ix + dx + 64 * cells) % cells, (iy + dy + 64 * cells) % cells, seed);
    };
    const float u = ease(x - fx), v = ease(y - fy);
    return std::lerp(std::lerp(corner(0, 0), corner(1, 0), u), std::lerp(corner(0, 1), corner(1, 1), u), v);
}

float clouds(Vector2f place, uint32_t cells, uint32_t seed) {
    float sum = 0, weight = 0.5f;
    for (uint32_t octave = 0; octave < 5; octave++, cells *= 2, weight *= 0.5f)
        sum += weight * noise(place, cells, seed + octave);
    return sum / 0.96875f;
}

Vector3f mix(const Vector3f& a, const Vector3f& b, float t) { return a + (b - a) * t; }
float step(float from, float to, float value) { return std::clamp((value - from) / (to - from), 0.0f, 1.0f); }
Vector3f palette(float t, uint32_t seed) {
    Vector3f color;
    for (int i = 0; i < 3; i++)
        color[i] =
            0.5f + 0.45f * std::cos(2 * pi * (t * (0.6f + randomAt(seed, 1, 7)) + randomAt(seed, uint32_t(i), 3)));
    return color;
}

/// Heights of brickwork in [0, 1], 0 in the joints, and which brick it is.
float bricks(Vector2f place, uint32_t columns, uint32_t rows, float joint, uint32_t& brick) {
    const float y = place.y * static_cast<float>(rows);
    const auto row = static_cast<uint32_t>(y);
    const float x = place.x * static_cast<float>(columns) + (row % 2 ? 0.5f : 0.0f);
    brick = row * columns + static_cast<uint32_t>(x) % columns;
    const auto edge = [&](float value, float cells) {
        const float inside = value - std::floor(value);
        return std::min(inside, 1 - inside) / (joint * cells);
    };
    return std::clamp(std::min(edge(x, static_cast<float>(columns)), edge(y, static_cast<float>(rows))), 0.0f, 1.0f);
}

using Paint = std::function<Vector3f(Vector2f)>;
using Value = std::function<float(Vector2f)>;

class Builder {
public:
    Scene scene;

    uint32_t image(const char* name, const Paint& paint) {
        Image picture = *Image::create(FormatRGBAu8n, image_size, image_size);
        for (uint32_t y = 0; y < image_size; y++)
            for (uint32_t x = 0; x < image_size; x++) picture.store(x, y, Vector4f(paint(place(x, y)), 1.0f));
        scene.images.push_back({name, std::move(picture)});
        scene.textures.push_back({.name = name, .image = static_cast<uint32_t>(scene.images.size() - 1)});
        return static_cast<uint32_t>(scene.textures.size() - 1);
    }
    /// The slopes of a height that is `depth` texels at most.
    uint32_t normals(const char* name, float depth, const Value& height) {
        constexpr float texel = 1.0f / image_size;
        return image(name, [&](Vector2f at) {
            const auto wrapped = [&](float x, float y) { return height({x - std::floor(x), y - std::floor(y)}); };
            const float dx = wrapped(at.x + texel, at.y) - wrapped(at.x - texel, at.y);
            const float dy = wrapped(at.x, at.y + texel) - wrapped(at.x, at.y - texel);
            // +Y of a normal texture points up the picture, v down.
            const Vector3f normal = glm::normalize(Vector3f(-0.5f * depth * dx, 0.5f * depth * dy, 1.0f));
            return normal * 0.5f + 0.5f;
        });
    }
    /// Metallic in blue, roughness in green.
    uint32_t surface(const char* name, const Value& metallic, const Value& roughness) {
        return image(name, [&](Vector2f at) { return Vector3f(0.0f, roughness(at), metallic(at)); });
    }
    uint32_t material(const char* name, uint32_t color, uint32_t normal, uint32_t metal, float metallic,
                      float roughness) {
        SceneMaterial made;
        made.name = name;
        made.base_color_texture.texture = color;
        made.normal_texture.texture = normal;
        made.metallic_roughness_texture.texture = metal;
        made.metallic = metallic;
        made.roughness = roughness;
        scene.materials.push_back(made);
        ScenePrimitive primitive;
        primitive.material = static_cast<uint32_t>(scene.materials.size() - 1);
        parts_.push_back(primitive);
        return primitive.material;
    }

    /// A grid of quads over (u, v) in [0, 1]^2; counter-clockwise from outside if the place goes right with u and down
    /// with v.
    void patch(uint32_t material, uint32_t columns, uint32_t rows, Vector2f repeats,
               const std::function<void(Vector2f, Vector3f&, Vector3f&)>& at) {
        ScenePrimitive& part = parts_[material];
        const auto first = static_cast<uint32_t>(part.positions.size());
        for (uint32_t y = 0; y <= rows; y++)
            for (uint32_t x = 0; x <= columns; x++) {
                const Vector2f uv(static_cast<float>(x) / static_cast<float>(columns),
                                  static_cast<float>(y) / static_cast<float>(rows));
                Vector3f position, normal;
                at(uv, position, normal);
                part.positions.push_back(position);
                part.normals.push_back(normal);
                part.texcoords[0].push_back(uv * repeats);
            }
        for (uint32_t y = 0; y < rows; y++)
            for (uint32_t x = 0; x < columns; x++) {
                const uint32_t a = first + y * (columns + 1) + x, b = a + columns + 1;
                part.indices.insert(part.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
            }
    }
    /// A rectangle: its top left corner, the way right and the way down.
    void wall(uint32_t material, const Vector3f& corner, const Vector3f& right, const Vector3f& down,
              Vector2f repeats) {
        const Vector3f normal = glm::normalize(glm::cross(down, right));
        patch(material, 1, 1, repeats, [&](Vector2f uv, Vector3f& position, Vector3f& n) {
            position = corner + right * uv.x + down * uv.y;
            n = normal;
        });
    }
    /// The sides of a box; a texture covers `unit`.
    void box(uint32_t material, const Vector3f& low, const Vector3f& high, float unit) {
        const Vector3f size = high - low, x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
        const auto side = [&](const Vector3f& corner, const Vector3f& right, const Vector3f& down) {
            wall(material, corner, right, down, Vector2f(glm::length(right), glm::length(down)) / unit);
        };
        side({low.x, high.y, high.z}, x, -y);
        side({high.x, high.y, low.z}, -x, -y);
        side({high.x, high.y, high.z}, -z, -y);
        side({low.x, high.y, low.z}, z, -y);
        side({low.x, high.y, low.z}, x, z);
        side({low.x, low.y, high.z}, x, -z);
    }
    void cylinder(uint32_t material, const Vector3f& base, float radius, float height, Vector2f repeats) {
        patch(material, 40, 1, repeats, [&](Vector2f uv, Vector3f& position, Vector3f& normal) {
            normal = {std::sin(2 * pi * uv.x), 0, std::cos(2 * pi * uv.x)};
            position = base + normal * radius + Vector3f(0, height * (1 - uv.y), 0);
        });
        // What a wider one shows of its ends.
        for (const float up : {1.0f, -1.0f})
            patch(material, 40, 1, {4, 1}, [&](Vector2f uv, Vector3f& position, Vector3f& normal) {
                const float angle = 2 * pi * uv.x * up, reach = radius * uv.y;
                position = base + Vector3f(reach * std::sin(angle), up > 0 ? height : 0, reach * std::cos(angle));
                normal = {0, up, 0};
            });
    }
    void ball(uint32_t material, const Vector3f& centre, float radius) {
        patch(material, 48, 24, {2, 1}, [&](Vector2f uv, Vector3f& position, Vector3f& normal) {
            const float around = 2 * pi * uv.x, down = pi * uv.y;
            normal = {std::sin(down) * std::sin(around), std::cos(down), std::sin(down) * std::cos(around)};
            position = centre + normal * radius;
        });
    }

    Scene finish() {
        for (ScenePrimitive& part : parts_) {
            scene.nodes.push_back(
                {.name = scene.materials[part.material].name, .mesh = static_cast<uint32_t>(scene.meshes.size())});
            scene.roots.push_back(static_cast<uint32_t>(scene.nodes.size() - 1));
            scene.meshes.push_back({.name = scene.materials[part.material].name, .primitives = {std::move(part)}});
        }
        return std::move(scene);
    }

private:
    static Vector2f place(uint32_t x, uint32_t y) {
        return (Vector2f(static_cast<float>(x), static_cast<float>(y)) + 0.5f) / static_cast<float>(image_size);
    }

    std::vector<ScenePrimitive> parts_;
};

float tileOf(Vector2f at, uint32_t& tile) {
    const Vector2f p = at * 4.0f;
    tile = static_cast<uint32_t>(p.x) + 4 * static_cast<uint32_t>(p.y);
    const Vector2f inside = glm::fract(p);
    return step(0.0f, 0.04f, std::min(std::min(inside.x, 1 - inside.x), std::min(inside.y, 1 - inside.y)));
}

uint32_t makeFloor(Builder& builder) {
    const uint32_t color = builder.image("floor", [](Vector2f at) {
        uint32_t tile = 0;
        const float inside = tileOf(at, tile);
        const float veins = std::abs(clouds(at, 6, 11 + tile) - 0.5f) * 2;
        const bool is_dark = (tile + tile / 4) % 2;
        const Vector3f stone = is_dark ? mix({0.42f, 0.36f, 0.33f}, {0.16f, 0.13f, 0.12f}, step(0, 0.3f, veins))
                                       : mix({0.70f, 0.62f, 0.54f}, {0.92f, 0.88f, 0.82f}, step(0, 0.3f, veins));
        return mix({0.35f, 0.33f, 0.31f}, stone, inside);
    });
    const uint32_t normal = builder.normals("floor normals", 5.0f, [](Vector2f at) {
        uint32_t tile = 0;
        return tileOf(at, tile);
    });
    const uint32_t metal = builder.surface(
        "floor surface", [](Vector2f) { return 0.0f; },
        [](Vector2f at) {
            uint32_t tile = 0;
            const float inside = tileOf(at, tile);
            return std::lerp(0.9f, 0.05f + 0.25f * clouds(at, 8, 5), inside);
        });
    return builder.material("floor", color, normal, metal, 1.0f, 1.0f);
}

uint32_t makeBricks(Builder& builder) {
    const auto height = [](Vector2f at) {
        uint32_t brick = 0;
        return bricks(at, 4, 8, 0.02f, brick) * (0.8f + 0.2f * clouds(at, 24, 3));
    };
    const uint32_t color = builder.image("bricks", [](Vector2f at) {
        uint32_t brick = 0;
        const float inside = bricks(at, 4, 8, 0.012f, brick);
        const Vector3f clay = mix({0.62f, 0.36f, 0.26f}, {0.78f, 0.55f, 0.40f}, randomAt(brick, 5, 2));
        return mix({0.66f, 0.63f, 0.58f}, clay * (0.75f + 0.35f * clouds(at, 16, 9)), inside);
    });
    const uint32_t normal = builder.normals("brick normals", 9.0f, height);
    const uint32_t metal = builder.surface(
        "brick surface", [](Vector2f) { return 0.0f; }, [](Vector2f at) { return 0.75f + 0.25f * clouds(at, 16, 1); });
    return builder.material("bricks", color, normal, metal, 1.0f, 1.0f);
}

uint32_t makeWood(Builder& builder) {
    const auto grain = [](Vector2f at) {
        const auto plank = static_cast<uint32_t>(at.y * 4);
        const float bend = clouds({at.x, at.y}, 4, 21 + plank);
        return 0.5f + 0.5f * std::sin(2 * pi * (10 * (at.y * 4) + 2.5f * bend));
    };
    const auto gap = [](Vector2f at) {
        const float inside = at.y * 4 - std::floor(at.y * 4);
        return step(0.0f, 0.05f, std::min(inside, 1 - inside));
    };
    const uint32_t color = builder.image("wood", [&](Vector2f at) {
        return mix({0.32f, 0.19f, 0.10f}, {0.52f, 0.34f, 0.19f}, 0.6f * grain(at) + 0.4f * clouds(at, 8, 4)) * gap(at);
    });
    const uint32_t normal =
        builder.normals("wood normals", 4.0f, [&](Vector2f at) { return gap(at) + 0.15f * grain(at); });
    return builder.material("wood", color, normal, scene_none, 0.0f, 0.6f);
}

uint32_t makeMarble(Builder& builder) {
    const uint32_t color = builder.image("marble", [](Vector2f at) {
        const float vein = std::abs(std::sin(2 * pi * (2 * at.y + 1.5f * clouds(at, 4, 33))));
        return mix({0.45f, 0.47f, 0.50f}, {0.93f, 0.91f, 0.87f}, step(0.0f, 0.35f, vein));
    });
    return builder.material("marble", color, scene_none, scene_none, 0.0f, 0.15f);
}

uint32_t makeBronze(Builder& builder) {
    const auto dents = [](Vector2f at) { return 1 - std::abs(2 * noise(at, 20, 8) - 1); };
    const uint32_t color = builder.image("bronze", [&](Vector2f at) {
        return mix({0.45f, 0.62f, 0.52f}, {0.80f, 0.56f, 0.30f}, step(0.25f, 0.5f, clouds(at, 6, 14)));
    });
    const uint32_t normal = builder.normals("bronze normals", 4.0f, dents);
    const uint32_t metal = builder.surface(
        "bronze surface", [](Vector2f at) { return step(0.25f, 0.5f, clouds(at, 6, 14)); },
        [](Vector2f at) { return 0.7f - 0.5f * step(0.25f, 0.5f, clouds(at, 6, 14)); });
    return builder.material("bronze", color, normal, metal, 1.0f, 1.0f);
}

/// Kinds 0 to 3: rusty, scratched, hammered and striped metal.
uint32_t makeBallMetal(Builder& builder, uint32_t kind) {
    static constexpr const char* names[] = {"rusty", "scratched", "hammered", "striped"};
    static const Vector3f metals[] = {
        {0.72f, 0.72f, 0.74f}, {0.95f, 0.93f, 0.88f}, {1.0f, 0.78f, 0.34f}, {0.95f, 0.64f, 0.54f}};
    const auto share = [kind](Vector2f at) {
        switch (kind) {
            case 0: return step(0.42f, 0.52f, clouds(at, 5, 40));
            case 1: return 1.0f;
            case 2: return 1.0f;
            default: return step(-0.15f, 0.15f, std::sin(2 * pi * 8 * at.y));
        }
    };
    const auto height = [kind, share](Vector2f at) {
        switch (kind) {
            case 0: return 0.4f * share(at) + 0.3f * clouds(at, 32, 6) * (1 - share(at));
            case 1: return 0.5f * step(0.48f, 0.5f, noise({at.x, at.y}, 64, 12));
            case 2: return std::abs(2 * noise(at, 14, 15) - 1);
            default: return share(at);
        }
    };
    const uint32_t color = builder.image(names[kind], [&](Vector2f at) {
        const Vector3f other = kind == 0 ? Vector3f(0.40f, 0.19f, 0.09f) * (0.6f + 0.8f * clouds(at, 24, 2))
                                         : Vector3f(0.12f, 0.20f, 0.42f);
        return mix(other, metals[kind], share(at));
    });
    const uint32_t normal = builder.normals(names[kind], 4.0f, height);
    const uint32_t metal = builder.surface(
        names[kind], share, [&](Vector2f at) { return std::lerp(0.8f, kind == 1 ? 0.1f : 0.2f, share(at)); });
    return builder.material(names[kind], color, normal, metal, 1.0f, 1.0f);
}

uint32_t makePicture(Builder& builder, uint32_t number) {
    const uint32_t color = builder.image("picture", [number](Vector2f at) {
        const Vector2f p = at * 2.0f - 1.0f;
        switch (number % 5) {
            case 0: {  // a Julia set
                Vector2f z = p * 1.4f;
                const float angle = 0.9f + 0.31f * static_cast<float>(number);
                const Vector2f c(0.74f * std::cos(angle), 0.74f * std::sin(angle));
                uint32_t steps = 0;
                while (steps < 48 && glm::dot(z, z) < 8) {
                    z = Vector2f(z.x * z.x - z.y * z.y, 2 * z.x * z.y) + c;
                    steps++;
                }
                return palette(static_cast<float>(steps) / 24.0f, number);
            }
            case 1: {  // hills
                Vector3f sky = mix(palette(0.1f, number), {1.0f, 0.95f, 0.85f}, at.y);
                const float sun = glm::length(p - Vector2f(0.4f, -0.4f));
                sky = mix({1.0f, 0.9f, 0.6f}, sky, step(0.18f, 0.2f, sun));
                for (uint32_t ridge = 0; ridge < 4; ridge++) {
                    const float height = 0.4f + 0.15f * static_cast<float>(ridge) -
                                         0.3f * (clouds({at.x, 0.3f}, 3, number * 7 + ridge) - 0.5f);
                    if (at.y > height) sky = mix(sky, palette(0.3f + 0.15f * static_cast<float>(ridge), number), 0.8f);
                }
                return sky;
            }
            case 2: {  // planes of colour
                uint32_t cell = 0;
                const float inside = bricks(at, 2 + number % 3, 3, 0.01f, cell);
                return inside < 1 ? Vector3f(0.05f) : palette(randomAt(cell, number, 4), number);
            }
            case 3: {  // rings
                const float ring = glm::length(p - Vector2f(0.25f * std::sin(static_cast<float>(number)), 0.1f));
                return palette(std::floor(ring * 9) / 9.0f + 0.05f * clouds(at, 24, number), number);
            }
            default: {  // marbled paper
                const float x = clouds(at, 4, number), y = clouds(at + 0.37f, 4, number + 9);
                return palette(clouds({at.x + 0.6f * x, at.y + 0.6f * y}, 3, number + 5) * 2.5f, number);
            }
        }
    });
    return builder.material("picture", color, scene_none, scene_none, 0.0f, 0.45f);
}

}  // namespace

Scene makeHall() {
    constexpr float wide = 220, high = 360, end = 1400;
    Builder builder;
    const uint32_t floor = makeFloor(builder), brick = makeBricks(builder), wood = makeWood(builder);
    const uint32_t marble = makeMarble(builder), bronze = makeBronze(builder);
    const uint32_t gold = builder.material("gold", scene_none, scene_none, scene_none, 1.0f, 0.25f);
    builder.scene.materials[gold].base_color = {1.0f, 0.72f, 0.3f, 1.0f};
    uint32_t balls[4];
    for (uint32_t kind = 0; kind < 4; kind++) balls[kind] = makeBallMetal(builder, kind);

    const Vector3f x(2 * wide, 0, 0), y(0, high, 0), z(0, 0, 2 * end);
    builder.wall(floor, {-wide, 0, -end}, x, z, {2.75f, 17.5f});
    builder.wall(wood, {-wide, high, end}, x, -z, {2, 14});
    builder.wall(brick, {-wide, high, end}, -z, -y, {14, 1.8f});
    builder.wall(brick, {wide, high, -end}, z, -y, {14, 1.8f});
    builder.wall(brick, {-wide, high, -end}, x, -y, {2.2f, 1.8f});
    builder.wall(brick, {wide, high, end}, -x, -y, {2.2f, 1.8f});

    uint32_t pictures = 0;
    for (int i = 0; i < 12; i++) {
        const float along = -1320.0f + 240.0f * static_cast<float>(i);
        builder.box(wood, {-wide, high - 26, along - 14}, {wide, high, along + 14}, 120);
        for (const float side : {-1.0f, 1.0f}) {
            const Vector3f foot(130 * side, 0, along);
            builder.cylinder(marble, foot, 20, high - 26, {2, 4});
            for (const float band : {0.0f, high - 42})
                builder.cylinder(bronze, foot + Vector3f(0, band, 0), 27, 16, {4, 0.4f});
            if (i == 11) continue;
            // A picture between two pillars, as its viewer sees it, in a frame of four bars.
            const float middle = along + 120, at = (wide - 1) * side, in = -6 * side;
            const uint32_t picture = makePicture(builder, pictures++);
            builder.wall(picture, {at, 215, middle - 70 * -side}, {0, 0, 140 * -side}, {0, -110, 0}, {1, 1});
            const auto bar = [&](float low_y, float high_y, float low_z, float high_z) {
                const float a = wide * side, b = wide * side + in;
                builder.box(gold, {std::min(a, b), low_y, low_z}, {std::max(a, b), high_y, high_z}, 40);
            };
            bar(213, 221, middle - 76, middle + 76);
            bar(99, 107, middle - 76, middle + 76);
            bar(107, 213, middle - 76, middle - 68);
            bar(107, 213, middle + 68, middle + 76);
            if (i % 2) continue;
            const Vector3f pedestal(130 * side, 0, middle);
            builder.box(marble, pedestal + Vector3f(-24, 0, -24), pedestal + Vector3f(24, 64, 24), 64);
            builder.ball(balls[(static_cast<uint32_t>(i) / 2 + (side > 0 ? 2u : 0u)) % 4],
                         pedestal + Vector3f(0, 94, 0), 30);
        }
    }
    return builder.finish();
}
