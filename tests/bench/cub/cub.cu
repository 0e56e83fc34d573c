// What CUB takes for the sorts and scans of the figures *.over_cub:
//
//     nvcc -O3 -arch=native -o cub tests/bench/cub/cub.cu && ./cub > cub.txt
//     GLINT_CUB=cub.txt build/release/tests/bench over_cub
//
// A line each: name, median milliseconds of 31 on the device after half a second of warming up.

#include <cub/cub.cuh>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace {

void check(cudaError_t error) {
    if (error == cudaSuccess) return;
    std::fprintf(stderr, "%s\n", cudaGetErrorString(error));
    std::exit(1);
}

template <class T>
T* allocate(size_t count) {
    T* memory = nullptr;
    check(cudaMalloc(&memory, count * sizeof(T)));
    return memory;
}

/// `work(scratch, bytes)` sets `bytes` if there is no scratch memory.
template <class Work>
void measure(const char* name, Work work) {
    size_t bytes = 0;
    work(nullptr, bytes);
    char* scratch = allocate<char>(bytes);
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin));
    check(cudaEventCreate(&end));
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::milliseconds(500)) {
        work(scratch, bytes);
        check(cudaDeviceSynchronize());
    }
    std::vector<float> times(31);
    for (float& time : times) {
        check(cudaEventRecord(begin));
        work(scratch, bytes);
        check(cudaEventRecord(end));
        check(cudaEventSynchronize(end));
        check(cudaEventElapsedTime(&time, begin, end));
    }
    std::nth_element(times.begin(), times.begin() + 15, times.end());
    std::printf("%s %.6f\n", name, times[15]);
    check(cudaFree(scratch));
}

void measureSize(const char* name, uint32_t size) {
    std::mt19937 random(1);
    std::vector<uint32_t> values(size);
    for (uint32_t& value : values) value = static_cast<uint32_t>(random());
    uint32_t* in = allocate<uint32_t>(size);
    uint32_t* out = allocate<uint32_t>(size);
    uint32_t* payload_in = allocate<uint32_t>(size);
    uint32_t* payload_out = allocate<uint32_t>(size);
    check(cudaMemcpy(in, values.data(), size * sizeof(uint32_t), cudaMemcpyHostToDevice));
    check(cudaMemset(payload_in, 1, size * sizeof(uint32_t)));
    char figure[64];
    for (const int bits : {32, 16}) {
        std::snprintf(figure, sizeof(figure), "sort.%s.%dbits", name, bits);
        measure(figure, [&](void* scratch, size_t& bytes) {
            check(cub::DeviceRadixSort::SortPairs(scratch, bytes, in, out, payload_in, payload_out, size, 0, bits));
        });
    }
    std::snprintf(figure, sizeof(figure), "scan.%s", name);
    measure(figure,
            [&](void* scratch, size_t& bytes) { check(cub::DeviceScan::ExclusiveSum(scratch, bytes, in, out, size)); });
    for (uint32_t* memory : {in, out, payload_in, payload_out}) check(cudaFree(memory));
}

}  // namespace

int main() {
    measureSize("1m", 1u << 20);
    measureSize("4m", 1u << 22);
    measureSize("16m", 1u << 24);
}
