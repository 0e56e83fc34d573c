// What a table of 2,048 textures costs the recording thread. draw.table.record_us: recording a list that binds it;
// list_us: recording and submitting such a list, over one without a table; set_us: setting an entry before that, over
// leaving the table as it is.

#include "bench/bench.h"

#include <fmt/format.h>

#include <array>

namespace glint::bench {

namespace {

constexpr uint32_t count = 2048;
constexpr uint32_t warm_up = 3;
constexpr uint32_t rounds = 31;

constexpr const char* source = R"(
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) buffer Result { vec4 result; };
#ifdef TABLE
layout(set = 1, binding = 0) uniform texture2D textures[];
void main() { result = texelFetch(textures[7], ivec2(0), 0); }
#else
void main() { result = vec4(1.0); }
#endif
)";

class Lists {
public:
    Lists(const Device& device, uint32_t mips) : device_(device) {
        for (Kernel* kernel : {&plain_, &reader_}) {
            *kernel = device_.createKernel();
            kernel->createShaderGLSL(source, kernel == &reader_ ? "TABLE=1" : "");
            check(kernel->create());
        }
        result_ = device_.createBuffer(Buffer::FlagStorage, 16);
        table_ = device_.createTextureTable(count);
        for (uint32_t i = 0; i <= count; i++) {
            TextureDesc desc = {.format = FormatRGBAu8n, .width = 256, .height = 256, .mipmaps = mips};
            if (mips == 1) desc.width = desc.height = 1;
            textures_.push_back(check(device_.createTexture(desc)));
            table_.set(i % count, textures_.back());
        }
        for (const Texture& texture : textures_) device_.clearTexture(texture, Color::black());
        check(device_.finish());
    }

    void record(bool has_table) {
        list_ = device_.createCompute();
        list_.setKernel(has_table ? reader_ : plain_);
        list_.setStorageBuffer(0, result_);
        if (has_table) list_.setTextureTable(0, table_);
        list_.dispatch(1);
        check(list_.end());
    }
    void submit() { check(device_.submit(list_)); }
    void wait() { check(device_.finish()); }
    void change() { table_.set(5, textures_[turn_++ % textures_.size()]); }

private:
    Device device_;
    Kernel plain_, reader_;
    Buffer result_;
    TextureTable table_;
    std::vector<Texture> textures_;
    Compute list_{nullptr};
    size_t turn_ = 0;
};

void run(Report& report) {
    Device device = createDevice();
    for (const uint32_t mips : {1u, 9u}) {
        Lists lists(device, mips);
        const auto both = [&](bool has_table) {
            lists.record(has_table);
            lists.submit();
        };
        const auto wait = [&] { lists.wait(); };
        both(false), wait();
        const double begin = threadSeconds();
        both(true);
        fmt::print("  {} textures of {} mip levels; the first list with them {:.1f} ms\n", count, mips,
                   (threadSeconds() - begin) * 1e3);
        wait();
        const std::array sides = {
            Side{[&] { both(false); }, wait},
            Side{[&] { both(true); }, wait},
            Side{[&] { lists.change(), both(true); }, wait},
            Side{[&] { lists.record(true); }, [&] { lists.submit(), lists.wait(); }},
        };
        const std::vector<Times> times = interleave(sides, warm_up, rounds);
        printTimes("no table", times[0]);
        printTimes("a table", times[1]);
        printTimes("a table with another entry", times[2]);
        printTimes("a table, recorded only", times[3]);
        if (mips > 1) continue;
        const auto micro = [](double seconds) { return seconds * 1e6; };
        report.add("draw.table.record_us", micro(times[3].median()), "us", "", deviceName(device));
        report.add("draw.table.list_us", micro(times[1].median() - times[0].median()), "us", "a list without a table",
                   deviceName(device));
        report.add("draw.table.set_us", micro(times[2].median() - times[1].median()), "us", "a table left as it is",
                   deviceName(device));
    }
}

}  // namespace

Benchmark tableBenchmark() { return {{"draw.table.record_us", "draw.table.list_us", "draw.table.set_us"}, run}; }

}  // namespace glint::bench
