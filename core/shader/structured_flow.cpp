#include "structured_flow.h"

#include <spirv/unified1/spirv.hpp>

#include <algorithm>

namespace glint::shader {

namespace {

bool endsBlock(uint32_t opcode) {
    switch (opcode) {
        case spv::OpBranch:
        case spv::OpBranchConditional:
        case spv::OpSwitch:
        case spv::OpReturn:
        case spv::OpReturnValue:
        case spv::OpKill:
        case spv::OpUnreachable:
        case spv::OpTerminateInvocation:
        case spv::OpIgnoreIntersectionKHR:
        case spv::OpTerminateRayKHR: return true;
        default: return false;
    }
}

/// The labels that an instruction names: all its ids but the first of a condition's or selector's.
std::vector<uint32_t> labelsOf(const Instruction& end) {
    std::vector<uint32_t> labels;
    if (end.opcode != spv::OpBranch && end.opcode != spv::OpBranchConditional && end.opcode != spv::OpSwitch)
        return labels;
    for (size_t i = end.opcode == spv::OpBranch ? 0 : 1; i < end.ids.size(); i++)
        labels.push_back(end.words[end.ids[i]]);
    return labels;
}

}  // namespace

bool FlowBlock::isLoop() const { return merge.opcode == spv::OpLoopMerge; }

StructuredFlow::StructuredFlow(const Instructions& function, const std::function<uint32_t()>& new_id) {
    std::unordered_map<uint32_t, uint32_t> last_parts;
    uint32_t label = 0;
    size_t begin = 0;
    for (const Instruction& item : function) {
        if (item.opcode == spv::OpFunction || item.opcode == spv::OpFunctionEnd) continue;
        if (item.opcode == spv::OpLabel) {
            label = item.result();
            begin = blocks.size();
            blocks.emplace_back().label = label;
            continue;
        }
        if (item.opcode == spv::OpVariable) {
            variables.push_back(item);
            continue;
        }
        FlowBlock& block = blocks.back();
        if (item.opcode == spv::OpPhi) {
            block.phis.push_back(item);
        } else if (item.opcode == spv::OpLoopMerge) {
            // What turns come back to is the first part.
            blocks[begin].merge = item;
        } else if (item.opcode == spv::OpSelectionMerge) {
            block.merge = item;
        } else if (endsBlock(item.opcode)) {
            block.end = item;
            block.targets = labelsOf(item);
        } else if (item.opcode == spv::OpTraceRayKHR) {
            const uint32_t rest = new_id();
            block.end = item;
            block.targets = {rest};
            blocks.emplace_back().label = rest;
            last_parts[label] = rest;
        } else {
            block.body.push_back(item);
        }
    }
    for (size_t i = 0; i < blocks.size(); i++) places_[blocks[i].label] = i;
    for (FlowBlock& block : blocks)
        for (Instruction& phi : block.phis)
            for (size_t i = 1; i < phi.operands().size(); i += 2)
                if (const auto last = last_parts.find(phi.operands()[i]); last != last_parts.end())
                    phi.operands()[i] = last->second;
    findDominators();
}

std::vector<uint32_t> StructuredFlow::successors(const FlowBlock& block) const {
    std::vector<uint32_t> result = block.targets;
    if (block.isHeader()) result.push_back(block.mergeBlock());
    if (block.isLoop()) result.push_back(block.merge.operands()[1]);
    return result;
}

/// By iteration to a fixed point: Cooper, Harvey and Kennedy, "A Simple, Fast Dominance Algorithm" (2001).
void StructuredFlow::findDominators() {
    std::vector<uint32_t> order;  // after all successors that are not above
    std::unordered_map<uint32_t, size_t> number;
    std::unordered_map<uint32_t, std::vector<uint32_t>> predecessors;
    std::vector<std::pair<uint32_t, size_t>> path = {{blocks[0].label, 0}};
    std::set<uint32_t> seen = {blocks[0].label};
    while (!path.empty()) {
        const uint32_t label = path.back().first;
        const std::vector<uint32_t> next = successors(at(label));
        if (path.back().second == next.size()) {
            number[label] = order.size();
            order.push_back(label);
            path.pop_back();
            continue;
        }
        const uint32_t successor = next[path.back().second++];
        predecessors[successor].push_back(label);
        if (seen.insert(successor).second) path.emplace_back(successor, 0);
    }
    const uint32_t root = blocks[0].label;
    dominators_[root] = root;
    const auto common = [&](uint32_t a, uint32_t b) {
        while (a != b) {
            while (number[a] < number[b]) a = dominators_[a];
            while (number[b] < number[a]) b = dominators_[b];
        }
        return a;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t i = order.size() - 1; i-- > 0;) {
            uint32_t found = 0;
            for (const uint32_t before : predecessors[order[i]])
                if (dominators_.contains(before)) found = found ? common(found, before) : before;
            uint32_t& known = dominators_[order[i]];
            changed = changed || known != found;
            known = found;
        }
    }
}

bool StructuredFlow::dominates(uint32_t above, uint32_t label) const {
    while (label != above) {
        const uint32_t next = dominators_.at(label);
        if (next == label) return false;
        label = next;
    }
    return true;
}

bool StructuredFlow::isWithin(uint32_t label, const FlowBlock& header) const {
    return dominates(header.label, label) && !dominates(header.mergeBlock(), label);
}

FlowPieces::FlowPieces(const StructuredFlow& flow) : flow_(flow) {
    heads_.insert(flow.blocks[0].label);
    for (const FlowBlock& block : flow.blocks)
        if (block.end.opcode == spv::OpTraceRayKHR && flow.isReached(block.label)) heads_.insert(block.targets[0]);
    while (dissolve() || assign()) {}
}

bool FlowPieces::dissolve() {
    bool changed = false;
    for (const FlowBlock& header : flow_.blocks) {
        if (!header.isHeader() || isDissolved(header.label) || !flow_.isReached(header.label)) continue;
        const bool is_whole = std::ranges::none_of(heads_, [&](uint32_t head) {
            return head == header.mergeBlock() || (head != header.label && flow_.isWithin(head, header));
        });
        if (is_whole) continue;
        changed = true;
        dissolved_.insert(header.label);
        for (const uint32_t next : flow_.successors(header)) heads_.insert(next);
        if (header.isLoop()) heads_.insert(header.label);
    }
    return changed;
}

bool FlowPieces::assign() {
    owners_.clear();
    const size_t before = heads_.size();
    for (const uint32_t head : std::set<uint32_t>(heads_)) {
        std::vector<uint32_t> open = {head};
        while (!open.empty()) {
            const uint32_t label = open.back();
            open.pop_back();
            const auto [owner, is_new] = owners_.try_emplace(label, head);
            if (!is_new) {
                // From two pieces: it begins one of its own.
                if (owner->second != head) heads_.insert(label);
                continue;
            }
            const FlowBlock& block = flow_.at(label);
            for (const uint32_t next : isDissolved(label) ? block.targets : flow_.successors(block))
                if (!heads_.contains(next)) open.push_back(next);
        }
    }
    return heads_.size() != before;
}

uint32_t FlowPieces::headOf(uint32_t label) const {
    const auto found = owners_.find(label);
    return found == owners_.end() ? 0 : found->second;
}

bool FlowPieces::leaves(uint32_t from, uint32_t to) const {
    if (!heads_.contains(to)) return false;
    // The way back to the beginning of a loop that is whole stays.
    return to != headOf(from) || !flow_.at(to).isLoop() || isDissolved(to);
}

}  // namespace glint::shader
