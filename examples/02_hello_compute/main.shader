struct Particle {
    vec4 position;  // w: radius
    vec4 velocity;  // w: life left
    vec4 color;     // w: whole life
    vec4 twist;     // angle, speed, damping of both speeds, opacity
};

#if EMIT_SHADER || UPDATE_SHADER

layout(local_size_x = GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform Simulation {
    vec4 gravity;
    vec4 wind;      // w: force
    float time_step;
    uint emitter_count;
    uint max_particles;
    uint frame;
};

#endif

#if EMIT_SHADER

// One group an emitter, as many rounds as it has particles to spawn.

struct Emitter {
    vec4 position;   // w: particles to spawn
    vec4 direction;  // w: velocity
    vec4 spread;     // velocity spread, radius mean and spread, life mean
    vec4 damping;    // damping, opacity, life spread, seed
    vec4 color;
};

layout(set = 0, binding = 1) uniform Emitters { Emitter emitters[10]; };
layout(std430, set = 0, binding = 2) writeonly buffer Particles { Particle particles[]; };
layout(std430, set = 0, binding = 3) buffer Counters { uint counters[2]; };

uint hash(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

uint random_state;

float random() {
    random_state = hash(random_state + 0x9e3779b9u);
    return float(random_state >> 8) / 16777216.0;
}

vec3 randomDirection() {
    float z = 2.0 * random() - 1.0;
    float angle = 6.2831853 * random();
    return vec3(sqrt(max(1.0 - z * z, 0.0)) * vec2(cos(angle), sin(angle)), z);
}

void main() {
    Emitter emitter = emitters[gl_WorkGroupID.x];
    uint spawned = uint(emitter.position.w);
    for (uint i = gl_LocalInvocationID.x; i < spawned; i += GROUP_SIZE) {
        // A state of its own for each particle: the same scene on every machine.
        random_state = hash(hash(frame * 64u + gl_WorkGroupID.x) + i);
        uint place = atomicAdd(counters[0], 1u);
        if (place >= max_particles) continue;
        Particle particle;
        float radius = emitter.spread.y + emitter.spread.z * random();
        vec3 direction = randomDirection();
        vec3 velocity = emitter.direction.xyz * emitter.direction.w + direction * emitter.spread.x * sqrt(random());
        float life = emitter.spread.w + emitter.damping.z * random();
        // Spawned within the step, not all at its begin.
        float age = time_step * random();
        particle.position = vec4(emitter.position.xyz + direction * 0.3 * random() + velocity * age, radius);
        particle.velocity = vec4(velocity, life - age);
        particle.color = vec4(emitter.color.rgb, life);
        particle.twist = vec4(6.2831853 * random(), 6.2831853 * random() - 3.14159265, emitter.damping.xy);
        particles[place] = particle;
    }
}

#elif ARGUMENTS_SHADER

// Between the passes: before the update the source's count becomes its groups, after it the destination's count becomes
// the draw's instances, the region that is sorted and the next source's count.

layout(local_size_x = 1) in;

layout(push_constant) uniform Phase { uint is_after; };

layout(std430, set = 0, binding = 0) buffer Counters { uint counters[2]; };
layout(std430, set = 0, binding = 1) writeonly buffer Indirect { uint indirect[7]; };
layout(std430, set = 0, binding = 2) writeonly buffer Region { uint region[4]; };  // keys, payload, size

const uint limit = 1u << 20;

void main() {
    if (is_after == 0u) {
        counters[0] = min(counters[0], limit);
        counters[1] = 0u;
        indirect[0] = (counters[0] + GROUP_SIZE - 1u) / GROUP_SIZE;
        indirect[1] = 1u;
        indirect[2] = 1u;
    } else {
        counters[0] = counters[1];
        indirect[3] = 4u;
        indirect[4] = counters[1];
        indirect[5] = 0u;
        indirect[6] = 0u;
        region[0] = 0u;
        region[1] = limit;
        region[2] = counters[1];
    }
}

#elif UPDATE_SHADER

layout(std430, set = 0, binding = 1) readonly buffer Source { Particle source[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Destination { Particle destination[]; };
layout(std430, set = 0, binding = 3) buffer Counters { uint counters[2]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= counters[0]) return;
    Particle particle = source[index];
    particle.velocity.w -= time_step;
    if (particle.velocity.w <= 0.0) return;

    vec3 velocity = particle.velocity.xyz;
    velocity += (gravity.xyz + (wind.xyz - velocity) * wind.w) * time_step;
    velocity *= exp(-particle.twist.z * time_step);
    particle.velocity.xyz = velocity;
    particle.position.xyz += velocity * time_step;
    if (particle.position.z < particle.position.w) {
        particle.position.z = particle.position.w;
        particle.velocity.z = abs(particle.velocity.z) * 0.5;
    }
    particle.twist.x += particle.twist.y * time_step;
    particle.twist.y *= exp(-particle.twist.z * time_step);
    destination[atomicAdd(counters[1], 1u)] = particle;
}

#elif KEYS_SHADER || VERTEX_SHADER

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform View { Camera camera; };
layout(std430, set = 0, binding = 1) readonly buffer Particles { Particle particles[]; };

#if KEYS_SHADER

#include <glint/parallel/key.h>

layout(local_size_x = GROUP_SIZE) in;

layout(std430, set = 0, binding = 2) readonly buffer Counters { uint counters[2]; };
layout(std430, set = 0, binding = 3) writeonly buffer Order { uint order[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= counters[0]) return;
    // The view looks along -z, so that the farthest have the smallest keys.
    order[index] = glintSortKey((camera.view * vec4(particles[index].position.xyz, 1.0)).z);
}

#else

// Keys, then the numbers of the particles in the order of their keys.
layout(std430, set = 0, binding = 2) readonly buffer Order { uint order[]; };
const uint limit = 1u << 20;

layout(location = 0) out vec2 s_texcoord;
layout(location = 1) out vec4 s_color;

void main() {
    Particle particle = particles[order[limit + gl_InstanceIndex]];
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 2.0 - 1.0;
    float s = sin(particle.twist.x), c = cos(particle.twist.x);
    vec4 position = camera.view * vec4(particle.position.xyz, 1.0);
    position.xy += mat2(c, s, -s, c) * corner * particle.position.w;
    gl_Position = camera.projection * position;
    s_texcoord = corner;
    // What is opaque covers what is behind it, what is not adds its light.
    s_color = vec4(particle.color.rgb, particle.twist.w) * smoothstep(0.0, 0.5, particle.velocity.w / particle.color.w);
}

#endif

#elif FRAGMENT_SHADER

layout(location = 0) in vec2 s_texcoord;
layout(location = 1) in vec4 s_color;

layout(location = 0) out vec4 out_color;

void main() {
    float edge = 1.0 - dot(s_texcoord, s_texcoord);
    if (edge <= 0.0) discard;
    out_color = s_color * edge * edge;
}

#elif TONE_SHADER

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0) uniform texture2D light;
layout(set = 0, binding = 1, rgba8) uniform writeonly image2D picture;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec3 color = texelFetch(light, pixel, 0).rgb + vec3(0.02, 0.025, 0.035);
    imageStore(picture, pixel, vec4(pow(1.0 - exp(-color), vec3(1.0 / 2.2)), 1.0));
}

#endif
