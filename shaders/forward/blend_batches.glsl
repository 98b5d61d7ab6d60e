// SPDX-License-Identifier: MIT
// What blend_records.comp and blend_half.comp do; the latter defines HALF_BLEND.
// Work: one workgroup per tile, one subgroup per block of it. A batch of as many splats as there are lanes is blended
// without looking for ends. As transmittance only falls, no pixel ended in the batch if all are at or above the stop
// afterwards. Otherwise the block goes back to before the batch and continues with blend.comp's tests to the end of its
// list. Both ways decide the same. Shared memory: a subgroup's own lists and records; no barrier. Reads and writes what
// blend.comp does, but leaves no checkpoints and does not resort by DEPTH_ORDER_PIXEL.

#include "forward/blend_interface.glsl"
const uint RECORDS = AREAS * SUBGROUP_SIZE;
#include "lib/records.glsl"
#include "forward/blend_pixels.glsl"

#ifdef HALF_BLEND
#include "lib/half_records.glsl"
#define VISIT_RECORD HalfRecord
#define VISIT_STRIDE HALF_RECORD
#define visit_base() half_records_base()
#define load_visit(at) load_half_record(at)
#define store_visit(at, r) store_half_record(at, r)
// The opacities of all pixels come first, by pairs.
#define ALPHAS(r) float raw_alphas[PIXELS]; half_alphas(r, offset, raw_alphas);
#define ALPHA(r, k) shown_alpha(raw_alphas[k])

float shown_alpha(float raw) {
    return mix(0.0, min(raw, ALPHA_MAX), raw >= ALPHA_CUTOFF);
}
#else
#define VISIT_RECORD Record
#define VISIT_STRIDE RECORD
#define visit_base() records_base()
#define load_visit(at) load_record(at)
#define store_visit(at, r) store_record(at, r)
#define ALPHAS(r)
#define ALPHA(r, k) alpha_of(r, offset + vec2(slot_offset(k)))

float alpha_of(Record r, vec2 offset) {
    float w, slope, by_exponent;
    const float raw = min(record_alpha(r, offset, w, slope, by_exponent), ALPHA_MAX);
    return mix(0.0, raw, raw >= ALPHA_CUTOFF);
}
#endif

// Blends a batch of `count` records, before which no pixel had ended. Returns false and leaves px unchanged where one
// ends in it.
bool blend_without_ends(inout Pixels px, uint count, vec2 offset) {
    float transmittance[PIXELS], depths[DEPTHS], squares[SPREADS], firsts[SPREADS];
    vec3 colour[PIXELS];
    for (uint k = 0u; k < PIXELS; ++k) {
        transmittance[k] = px.transmittance[k];
        colour[k] = px.colour[k];
        if (DEPTH_SUM == 1) depths[k] = depth_sum[k];
        if (DEPTH_SPREAD == 1) {
            squares[k] = square_sum[k];
            firsts[k] = first_depth[k];
        }
    }
    uint at = visit_base(), turn = 0u, number = 0u;
    do {
        const VISIT_RECORD r = load_visit(at);
        ALPHAS(r)
        [[unroll]] for (uint k = 0u; k < PIXELS; ++k) {  // no loop, whose rounds lavapipe counts: LIST_SEGMENT
            const float share = ALPHA(r, k) * transmittance[k];
            colour[k] += share * r.colour;
            float depth = r.depth;
            if (DEPTH_SPREAD == 1) {
                firsts[k] = transmittance[k] == 1.0 ? depth : firsts[k];
                depth -= firsts[k];
                squares[k] += share * (depth * depth);
            }
            if (DEPTH_SUM == 1) depths[k] += share * depth;
            transmittance[k] -= share;
        }
        number = r.number;
        at += VISIT_STRIDE;
    } while (++turn < count);
    float least = transmittance[0];
    for (uint k = 1u; k < PIXELS; ++k) least = min(least, transmittance[k]);
    const bool ended = subgroupAny(least < MIN_TRANSMITTANCE);
    for (uint k = 0u; k < PIXELS; ++k) {
        px.transmittance[k] = ended ? px.transmittance[k] : transmittance[k];
        px.colour[k] = ended ? px.colour[k] : colour[k];
        if (DEPTH_SUM == 1) depth_sum[k] = ended ? depth_sum[k] : depths[k];
        if (DEPTH_SPREAD == 1) {
            square_sum[k] = ended ? square_sum[k] : squares[k];
            first_depth[k] = ended ? first_depth[k] : firsts[k];
        }
        if (STORE_FOR_BACKWARD == 1) px.last[k] = ended ? px.last[k] : number;
    }
    return !ended;
}

void blend_with_ends(inout Pixels px, uint count, vec2 offset) {
    uint at = visit_base(), turn = 0u;
    do {
        const VISIT_RECORD r = load_visit(at);
        ALPHAS(r)
        [[unroll]] for (uint k = 0u; k < PIXELS; ++k)
            blend_sample(px, k, ALPHA(r, k), r.colour, r.depth, r.number);
        at += VISIT_STRIDE;
    } while (++turn < count);
}

// Blends all collected splats, at least one, in order; returns false when every pixel has ended. any_ended: some pixel
// has ended.
bool blend_hits(inout Pixels px, inout bool any_ended, vec2 centre, uint count) {
    const vec2 offset = first_offset();
    float alive = 1.0;
    uint batch = 0u;
    do {  // tested at the bottom, as are the inner loops: see emit_cells
        const uint mine = batch + gl_SubgroupInvocationID;
        order_within_subgroup();  // other lanes may still read the records
        if (mine < count)
            store_visit(visit_base() + gl_SubgroupInvocationID * VISIT_STRIDE,
                        make_record(hit_splat[hits_base() + mine], hit_index[hits_base() + mine] + 1u, centre));
        order_within_subgroup();
        const uint size = min(SUBGROUP_SIZE, count - batch);
        if (!any_ended) any_ended = !blend_without_ends(px, size, offset);
        if (any_ended) blend_with_ends(px, size, offset);
        alive = px.transmittance[0];
        for (uint k = 1u; k < PIXELS; ++k) alive = max(alive, px.transmittance[k]);
        batch += SUBGROUP_SIZE;
    } while (batch < count && subgroupAny(alive >= 0.0));
    return subgroupAny(alive > 0.0);
}

#include "forward/blend_state.glsl"

void main() {
    const uvec2 tile = own_tile();
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    const uint bits = area_bits(gl_SubgroupID);
    const uvec2 first = tile * TILE_SIZE + first_pixel(gl_SubgroupID, gl_SubgroupInvocationID);
    const vec2 centre = block_centre(tile, gl_SubgroupID);

    Pixels px;
    for (uint k = 0u; k < PIXELS; ++k) {
        const uvec2 at = first + slot_offset(k);
        px.transmittance[k] = at.x < args.width && at.y < args.height ? 1.0 : -1.0;
        px.colour[k] = vec3(0.0);
        px.last[k] = 0u;
        clear_depths(k);
    }
    if (SEGMENT > 0u && args.segment > 0u) load(px, first);
    float least = px.transmittance[0];
    for (uint k = 1u; k < PIXELS; ++k) least = min(least, px.transmittance[k]);
    bool any_ended = subgroupAny(least < 0.0);  // or it lies beside the picture
    if (range.x < range.y) {
        uint chunk = range.x;
        bool alive = true;
        do {
            const uint count = collect_hits(chunk, min(chunk + CHUNK, range.y), bits);
            if (count > 0u) alive = blend_hits(px, any_ended, centre, count);
            chunk += CHUNK;
        } while (alive && chunk < range.y);
    }
    store(px, first);
}
