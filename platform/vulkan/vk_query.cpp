#include "platform/vulkan/vk_query.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>

#include <algorithm>

namespace glint::vulkan {

namespace {

// Results come in the order of the bits, which is that of Query::Statistics.
constexpr VkQueryPipelineStatisticFlags statistics =
    VK_QUERY_PIPELINE_STATISTIC_INPUT_ASSEMBLY_VERTICES_BIT |
    VK_QUERY_PIPELINE_STATISTIC_INPUT_ASSEMBLY_PRIMITIVES_BIT |
    VK_QUERY_PIPELINE_STATISTIC_VERTEX_SHADER_INVOCATIONS_BIT | VK_QUERY_PIPELINE_STATISTIC_CLIPPING_INVOCATIONS_BIT |
    VK_QUERY_PIPELINE_STATISTIC_CLIPPING_PRIMITIVES_BIT | VK_QUERY_PIPELINE_STATISTIC_FRAGMENT_SHADER_INVOCATIONS_BIT |
    VK_QUERY_PIPELINE_STATISTIC_COMPUTE_SHADER_INVOCATIONS_BIT;

}  // namespace

Expected<std::unique_ptr<VulkanQuery>> VulkanQuery::create(VulkanDevice& device, Query::Type type) {
    std::unique_ptr<VulkanQuery> query(new VulkanQuery(device, type));
    VkQueryPoolCreateInfo info = {VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    switch (type) {
        case Query::TypeTime: info.queryType = VK_QUERY_TYPE_TIMESTAMP; break;
        case Query::TypeSamples: info.queryType = VK_QUERY_TYPE_OCCLUSION; break;
        case Query::TypeStatistics:
            info.queryType = VK_QUERY_TYPE_PIPELINE_STATISTICS;
            info.pipelineStatistics = statistics;
            break;
    }
    info.queryCount = query->slots();
    const VkResult result = device.vk.CreateQueryPool(device.handle, &info, nullptr, &query->pool_);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateQueryPool", result));
    device.memory.objects_created++;
    return query;
}

VulkanQuery::~VulkanQuery() { device_.vk.DestroyQueryPool(device_.handle, pool_, nullptr); }

void VulkanQuery::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_QUERY_POOL, pool_, name); }

Expected<std::array<uint64_t, 7>> VulkanQuery::result() const {
    std::array<uint64_t, 7> sum = {};
    if (used > slots()) {
        return unexpected(makeError(ErrorCode::Unsupported, "query.split",
                                    "{} barriers split the query's target, at most {} can be counted over", used - 1,
                                    slots() - 1));
    }
    const size_t words = type_ == Query::TypeStatistics ? 7 : 1;
    std::array<uint64_t, 7> slot = {};
    for (uint32_t i = 0; i < used; i++) {
        const VkResult result =
            device_.vk.GetQueryPoolResults(device_.handle, pool_, i, 1, words * sizeof(uint64_t), slot.data(),
                                           words * sizeof(uint64_t), VK_QUERY_RESULT_64_BIT);
        if (result != VK_SUCCESS) return unexpected(resultError("vkGetQueryPoolResults", result));
        if (type_ == Query::TypeTime) {
            sum[i] = slot[0];
        } else {
            for (size_t word = 0; word < words; word++) sum[word] += slot[word];
        }
    }
    if (type_ != Query::TypeTime) return sum;

    // Counters narrower than 64 bits wrap; of two, the later one is at most one round ahead.
    const uint64_t mask = timestamp_bits >= 64 ? ~0ull : (1ull << timestamp_bits) - 1;
    const uint64_t begin = sum[0] & mask;
    const uint64_t ticks = (sum[1] - sum[0]) & mask;
    const double period = device_.features().timestampPeriod;
    const auto nanoseconds = [period](uint64_t count) {
        return period == 1.0 ? count : static_cast<uint64_t>(static_cast<double>(count) * period);
    };
    sum[0] = nanoseconds(begin);
    sum[1] = sum[0] + nanoseconds(ticks);
    return sum;
}

}  // namespace glint::vulkan
