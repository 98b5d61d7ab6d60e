// SPDX-License-Identifier: MIT
// The bindings that all scatter shaders of the radix sort share (step 3 of 3 of a pass).
layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 32;
layout(constant_id = 1) const uint ITEMS = 256;   // keys of one thread
layout(constant_id = 4) const uint DIGITS = RADIX_MAX_DIGITS;  // the most that a digit has
layout(constant_id = 2) const bool IOTA = false;     // value i is i, and is not read

layout(push_constant, scalar) uniform Push { RadixPassArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer Plan { RadixPlan plan; };
layout(set = 0, binding = 1, scalar) readonly buffer Offsets { uint offsets[]; };
layout(set = 0, binding = 2, scalar) readonly buffer KeysIn { uint keys_in[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ValuesIn { uint values_in[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer KeysOut { uint keys_out[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer ValuesOut { uint values_out[]; };

uint digit_of(uint key) {
    return (key >> args.shift) & (args.digits - 1);
}

uint value_of(uint index) {
    return IOTA ? index : values_in[index];
}

// The place of this block's first key with the digit.
uint block_offset(uint digit) {
    return offsets[digit * gl_NumWorkGroups.x + gl_WorkGroupID.x];
}
