// SPDX-License-Identifier: MIT
#include "engine/gpu/spirv_reflect.h"

#include <algorithm>
#include <map>
#include <unordered_map>

#include "engine/core/error.h"

namespace darb {

namespace {

// Numbers from the SPIR-V specification, section 3.
enum Op : std::uint32_t {
    kOpName = 5,
    kOpExecutionMode = 16,
    kOpCapability = 17,
    kOpTypeBool = 20,
    kOpTypeInt = 21,
    kOpTypeFloat = 22,
    kOpTypeVector = 23,
    kOpTypeMatrix = 24,
    kOpTypeArray = 28,
    kOpTypeRuntimeArray = 29,
    kOpTypeStruct = 30,
    kOpTypePointer = 32,
    kOpConstant = 43,
    kOpSpecConstantTrue = 48,
    kOpSpecConstantFalse = 49,
    kOpSpecConstant = 50,
    kOpSpecConstantComposite = 51,
    kOpFunction = 54,
    kOpVariable = 59,
    kOpDecorate = 71,
    kOpMemberDecorate = 72,
};
enum Decoration : std::uint32_t {
    kSpecId = 1,
    kArrayStride = 6,
    kMatrixStride = 7,
    kBuiltIn = 11,
    kNonWritable = 24,
    kNonReadable = 25,
    kBinding = 33,
    kDescriptorSet = 34,
    kOffset = 35,
};
enum Storage : std::uint32_t {
    kUniformConstant = 0,
    kUniform = 2,
    kPushConstant = 9,
    kBuffer = 12
};
constexpr std::uint32_t kSpirvMagic = 0x07230203, kLocalSize = 17, kWorkgroupSize = 25;
constexpr std::uint32_t kGroupNonUniform = 61;
constexpr size_t kHeaderWords = 5;

using Operands = std::span<const std::uint32_t>;
using Decorations = std::map<std::uint32_t, std::uint32_t>;  // decoration -> first operand or 1

struct Instruction {
    std::uint32_t op = 0;
    std::vector<std::uint32_t> operands;
};

struct Module {
    std::unordered_map<std::uint32_t, std::string> names;
    std::unordered_map<std::uint32_t, Instruction> results;  // types, constants, by id
    std::unordered_map<std::uint32_t, Decorations> decorations;
    std::map<std::pair<std::uint32_t, std::uint32_t>, Decorations> members;
    std::vector<std::uint32_t> variables, constants;  // ids in order

    const Decorations& of(std::uint32_t id) const {
        static const Decorations kNone;
        const auto found = decorations.find(id);
        return found == decorations.end() ? kNone : found->second;
    }
    const Decorations& of(std::uint32_t id, std::uint32_t member) const {
        static const Decorations kNone;
        const auto found = members.find({id, member});
        return found == members.end() ? kNone : found->second;
    }
    std::uint32_t member_value(std::uint32_t id, std::uint32_t member, Decoration key) const {
        const auto& all = of(id, member);
        const auto found = all.find(key);
        return found == all.end() ? 0 : found->second;
    }
};

std::string text_of(Operands operands) {
    std::string text;
    for (const std::uint32_t word : operands)
        for (int shift = 0; shift < 32; shift += 8) {
            const char c = static_cast<char>(word >> shift & 0xff);
            if (c == '\0') return text;
            text += c;
        }
    return text;
}

struct Extent {
    std::uint32_t bytes = 0;
    std::uint32_t align = 1;
};

// Size in scalar layout, strides and offsets taken from the module. matrix_stride: of the member.
Extent extent_of(const Module& module, std::uint32_t type, std::uint32_t matrix_stride) {
    const Instruction& t = module.results.at(type);
    switch (t.op) {
        case kOpTypeBool:
            return {4, 4};
        case kOpTypeInt:
        case kOpTypeFloat:
            return {t.operands[1] / 8, t.operands[1] / 8};
        case kOpTypeVector: {
            const Extent e = extent_of(module, t.operands[1], 0);
            return {e.bytes * t.operands[2], e.align};
        }
        case kOpTypeMatrix: {
            const Extent column = extent_of(module, t.operands[1], 0);
            return {matrix_stride * (t.operands[2] - 1) + column.bytes, column.align};
        }
        case kOpTypeArray: {
            const Extent e = extent_of(module, t.operands[1], matrix_stride);
            const std::uint32_t count = module.results.at(t.operands[2]).operands[2];
            return {module.of(type).at(kArrayStride) * (count - 1) + e.bytes, e.align};
        }
        case kOpTypeStruct: {
            Extent all;
            for (std::uint32_t m = 0; m + 1 < t.operands.size(); ++m) {
                const Extent e = extent_of(module, t.operands[m + 1],
                                           module.member_value(type, m, kMatrixStride));
                all.bytes = std::max(all.bytes, module.member_value(type, m, kOffset) + e.bytes);
                all.align = std::max(all.align, e.align);
            }
            all.bytes = (all.bytes + all.align - 1) / all.align * all.align;
            return all;
        }
        default:
            DARB_CHECK(false, "type op {}", t.op);
            return {};
    }
}

void read_instruction(std::uint32_t op, Operands operands, Module& module, ShaderInterface& out) {
    switch (op) {
        case kOpCapability:
            out.uses_subgroups = out.uses_subgroups || operands[0] == kGroupNonUniform;
            out.capabilities.push_back(operands[0]);
            break;
        case kOpName:
            module.names[operands[0]] = text_of(operands.subspan(1));
            break;
        case kOpDecorate:
            module.decorations[operands[0]][operands[1]] = operands.size() > 2 ? operands[2] : 1;
            break;
        case kOpMemberDecorate:
            module.members[{operands[0], operands[1]}][operands[2]] =
                operands.size() > 3 ? operands[3] : 1;
            break;
        case kOpExecutionMode:
            if (operands[1] == kLocalSize)
                std::copy_n(operands.begin() + 2, 3, out.local_size.begin());
            break;
        case kOpSpecConstantComposite: {  // ids, resolved once the constants are known
            const auto& decorations = module.of(operands[1]);
            const auto builtin = decorations.find(kBuiltIn);
            if (builtin != decorations.end() && builtin->second == kWorkgroupSize)
                std::copy_n(operands.begin() + 2, 3, out.local_size_spec_id.begin());
            break;
        }
        case kOpTypeBool:
        case kOpTypeInt:
        case kOpTypeFloat:
        case kOpTypeVector:
        case kOpTypeMatrix:
        case kOpTypeArray:
        case kOpTypeRuntimeArray:
        case kOpTypeStruct:
        case kOpTypePointer:
            module.results[operands[0]] = {op, {operands.begin(), operands.end()}};
            break;
        case kOpConstant:
        case kOpSpecConstant:
        case kOpSpecConstantTrue:
        case kOpSpecConstantFalse:
        case kOpVariable:
            module.results[operands[1]] = {op, {operands.begin(), operands.end()}};
            if (op == kOpVariable)
                module.variables.push_back(operands[1]);
            else if (op != kOpConstant)
                module.constants.push_back(operands[1]);
            break;
        default:
            break;
    }
}

void add_constant(const Module& module, std::uint32_t id, ShaderInterface& out) {
    const auto& decorations = module.of(id);
    const auto spec_id = decorations.find(kSpecId);
    if (spec_id == decorations.end()) return;
    const Instruction& value = module.results.at(id);
    const Instruction& type = module.results.at(value.operands[0]);
    ShaderInterface::Constant constant;
    constant.id = spec_id->second;
    using Type = ShaderInterface::ScalarType;
    if (type.op == kOpTypeBool)
        constant.type = Type::boolean;
    else if (type.op == kOpTypeFloat)
        constant.type = Type::floating;
    else
        constant.type = type.operands[2] != 0 ? Type::signed_int : Type::unsigned_int;
    constant.default_bits =
        value.op == kOpSpecConstant ? value.operands[2] : value.op == kOpSpecConstantTrue;
    if (const auto name = module.names.find(id); name != module.names.end())
        constant.name = name->second;
    const auto twin = std::find_if(out.constants.begin(), out.constants.end(),
                                   [&](const auto& other) { return other.id == constant.id; });
    if (twin == out.constants.end())
        out.constants.push_back(constant);
    else if (twin->name.empty())
        *twin = constant;
}

// readonly and writeonly stand on the variable or on every member of its block.
bool has_everywhere(const Module& module, std::uint32_t variable, std::uint32_t block,
                    Decoration key) {
    if (module.of(variable).contains(key)) return true;
    const size_t count = module.results.at(block).operands.size() - 1;
    for (std::uint32_t m = 0; m < count; ++m)
        if (!module.of(block, m).contains(key)) return false;
    return count > 0;
}

void add_variable(const Module& module, std::uint32_t id, ShaderInterface& out) {
    const Instruction& variable = module.results.at(id);
    const std::uint32_t storage = variable.operands[2];
    const std::uint32_t type = module.results.at(variable.operands[0]).operands[2];
    if (storage == kPushConstant) out.push_constant_bytes = extent_of(module, type, 0).bytes;
    if (storage != kBuffer && storage != kUniform && storage != kUniformConstant) return;
    ShaderInterface::Binding binding;
    const auto& decorations = module.of(id);
    binding.set = decorations.at(kDescriptorSet);
    binding.binding = decorations.at(kBinding);
    binding.storage_buffer = storage == kBuffer && module.results.at(type).op == kOpTypeStruct;
    if (binding.storage_buffer) {
        binding.writes = !has_everywhere(module, id, type, kNonWritable);
        binding.reads = !has_everywhere(module, id, type, kNonReadable);
    }
    if (const auto name = module.names.find(id); name != module.names.end())
        binding.name = name->second;
    for (ShaderInterface::Binding& twin : out.bindings) {  // two views of one buffer
        if (twin.set != binding.set || twin.binding != binding.binding) continue;
        twin.reads |= binding.reads;
        twin.writes |= binding.writes;
        return;
    }
    out.bindings.push_back(std::move(binding));
}

void resolve_local_size(const Module& module, ShaderInterface& out) {
    for (size_t axis = 0; axis < 3; ++axis) {
        if (out.local_size_spec_id[axis] < 0) continue;
        const auto id = static_cast<std::uint32_t>(out.local_size_spec_id[axis]);
        const auto found = module.results.find(id);
        out.local_size[axis] = found == module.results.end() ? 1 : found->second.operands[2];
        const auto& decorations = module.of(id);
        const auto spec_id = decorations.find(kSpecId);
        out.local_size_spec_id[axis] = spec_id == decorations.end() ? -1 : spec_id->second;
    }
}

}  // namespace

ShaderInterface reflect_spirv(std::span<const std::uint32_t> words, std::string_view shader) {
    DARB_CHECK(words.size() > kHeaderWords && words[0] == kSpirvMagic, "{} is no SPIR-V", shader);
    Module module;
    ShaderInterface out;
    for (size_t at = kHeaderWords; at < words.size();) {
        const std::uint32_t length = words[at] >> 16;
        DARB_CHECK(length > 0 && at + length <= words.size(), "{}: word {}", shader, at);
        if ((words[at] & 0xffff) == kOpFunction) break;  // no interface beyond
        read_instruction(words[at] & 0xffff, words.subspan(at + 1, length - 1), module, out);
        at += length;
    }
    for (const std::uint32_t id : module.constants) add_constant(module, id, out);
    for (const std::uint32_t id : module.variables) add_variable(module, id, out);
    resolve_local_size(module, out);
    std::sort(out.constants.begin(), out.constants.end(),
              [](const auto& a, const auto& b) { return a.id < b.id; });
    std::sort(out.bindings.begin(), out.bindings.end(), [](const auto& a, const auto& b) {
        return std::pair(a.set, a.binding) < std::pair(b.set, b.binding);
    });
    return out;
}

}  // namespace darb
