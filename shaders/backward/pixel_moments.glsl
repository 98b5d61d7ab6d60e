// SPDX-License-Identifier: MIT
// What blend_backward_pixels.comp and blend_backward_half.comp do; the latter defines HALF_BLEND.

#include "backward/team_interface.glsl"
layout(constant_id = 33) const uint BATCH = 8;  // splats whose numbers are held at a time, 4 or 8

const uint CHUNK = 32u;
#define PARTIALS_BINDING 9
#define PARTIALS_PUT_FOURS
#include "lib/partials.glsl"
#include "lib/log_form.glsl"
// The splats of a batch. Each needs a lane at least, and four numbers per pixel leave room for fewer.
const uint MOST = LOG_FORM ? BATCH : 4u;
const uint SPLATS = MOST < SUBGROUP_SIZE ? MOST : SUBGROUP_SIZE;
const uint TEAM = AREAS, RECORDS = TEAM * SPLATS;
#include "lib/records.glsl"
#ifdef HALF_BLEND
#include "lib/half_records.glsl"
#endif
#include "backward/area_pixels.glsl"
#include "backward/area_state.glsl"

// Every array is a multiple of 16 bytes long, so that all vec4 are read 16 bytes at a time. Two pixels of a lane form a
// pair, four rows apart: pair 8 row + column of the block's upper half.
const uint PAIRS = 32u, PAIR_STRIDE = 33u;  // the stride keeps the banks of neighbouring splats apart
const uint MORE = LOG_FORM ? 1u : TEAM * SPLATS * PAIR_STRIDE;
shared vec4 pair_shares[TEAM * SPLATS * PAIR_STRIDE];  // G and W of a pair's upper pixel, then of its lower one
shared vec4 pair_more[MORE];  // dL/d(alpha) w and dL/d(exponent) of both pixels
shared vec4 pair_colour[TEAM * PAIRS];                 // dL/dcolour: rgb of the upper pixel, r of the lower one
shared vec2 pair_colour_rest[TEAM * PAIRS];            // gb of the lower one
shared vec2 pair_depth[DEPTH_SUM == 1 ? TEAM * PAIRS : 2u];  // dL/d(depth) of both pixels
const uint SPREAD_PAIRS = DEPTH_SPREAD == 1 ? TEAM * PAIRS : 2u;
shared vec2 pair_square[SPREAD_PAIRS], pair_first_depth[SPREAD_PAIRS];  // the others of load_depth_gradient

// The sums of an intersection over a block: the partials in two halves, and those beside them.
const uint OTHERS = RESTS + (SHAPED ? 1u : 0u);
shared vec4 chunk_halves[TEAM * CHUNK * 2u];
shared float chunk_others[TEAM * CHUNK * OTHERS];
shared uint chunk_slot[CHUNK], chunk_word[CHUNK];  // for each intersection: its slot; its splat and blocks
shared uint area_end[TEAM];  // the list's intersections before it reach a pixel of the area
uint chunk_begin;

const uint PARTS = SUBGROUP_SIZE / SPLATS;                  // lanes that share a splat
const uint ROWS_OF_PART = PARTS > 4u ? 1u : 4u / PARTS;     // how many of the four rows of pairs
const uint COLUMNS_OF_PART = PARTS > 4u ? 4u : 8u;

void put_colours(Pixels px) {
    for (uint k = 0u; k < PIXELS / 2u; ++k) {
        const uint pair = gl_SubgroupID * PAIRS + k * SUBGROUP_SIZE + gl_SubgroupInvocationID;
        const vec3 upper = px.d_colour[k], lower = px.d_colour[k + PIXELS / 2u];
        pair_colour[pair] = vec4(upper, lower.r);
        pair_colour_rest[pair] = lower.gb;
        if (DEPTH_SUM == 1) {
            const vec3 above = d_depth[k], below = d_depth[k + PIXELS / 2u];
            pair_depth[pair] = vec2(above.x, below.x);
            if (DEPTH_SPREAD == 1) {
                pair_square[pair] = vec2(above.y, below.y);
                pair_first_depth[pair] = vec2(above.z, below.z);
            }
        }
    }
}

// A splat at pixel k of the thread, from behind. Returns its numbers G and W, and the others. Afterwards transmittance
// and behind hold their values before the splat.
#ifdef HALF_BLEND
vec4 visit(inout Pixels px, uint k, HalfRecord r, float raw) {
    const float w = 0.0, slope = 0.0, by_exponent = 0.0;  // of no use with LOG_FORM
#else
vec4 visit(inout Pixels px, uint k, Record r, vec2 offset) {
    float w, slope, by_exponent;
    const float raw = record_alpha(r, offset, w, slope, by_exponent);
#endif
    const bool reached = r.number <= px.last[k], shown = raw >= ALPHA_CUTOFF, moves = raw < ALPHA_MAX;
    const bool counts = shown && reached;
    const float alpha = mix(0.0, min(raw, ALPHA_MAX), counts);
    const float before = px.transmittance[k] / (1.0 - alpha);
    float ahead = dot(r.colour, px.d_colour[k]) - px.behind[k];
    if (DEPTH_SUM == 1) ahead += depth_by_weight(r.depth, d_depth[k]);
    const float d_alpha = mix(0.0, before * ahead, counts && moves);
    px.behind[k] += alpha * ahead;
    px.transmittance[k] = before;
    return vec4(d_alpha * (LOG_FORM ? raw : slope), alpha * before, d_alpha * w, d_alpha * by_exponent);
}

// Walks the batch's records, last to first; each puts its numbers into shared memory.
void visit_batch(inout Pixels px, uint size) {
    const vec2 offset = first_offset();
#ifdef HALF_BLEND
    uint at = half_records_base(), turn = 0u;
#else
    uint at = records_base(), turn = 0u;
#endif
    uint to = gl_SubgroupID * SPLATS * PAIR_STRIDE + gl_SubgroupInvocationID;
    [[dont_unroll]] do {
#ifdef HALF_BLEND
        const HalfRecord r = load_half_record(at);
#else
        const Record r = load_record(at);
#endif
        [[unroll]] for (uint k = 0u; k < PIXELS / 2u; ++k) {  // no loop, whose rounds lavapipe counts: LIST_SEGMENT
#ifdef HALF_BLEND
            const vec2 raw = half_pair_alpha(r, offset + vec2(slot_offset(k)));
            const vec4 upper = visit(px, k, r, raw.x);
            const vec4 lower = visit(px, k + PIXELS / 2u, r, raw.y);
#else
            const vec4 upper = visit(px, k, r, offset + vec2(slot_offset(k)));
            const vec4 lower = visit(px, k + PIXELS / 2u, r, offset + vec2(slot_offset(k + PIXELS / 2u)));
#endif
            pair_shares[to + k * SUBGROUP_SIZE] = vec4(upper.xy, lower.xy);
            if (!LOG_FORM) pair_more[to + k * SUBGROUP_SIZE] = vec4(upper.zw, lower.zw);
        }
        to += PAIR_STRIDE;
#ifdef HALF_BLEND
        at += HALF_RECORD;
#else
        at += RECORD;
#endif
    } while (++turn < size);
}

// Sums of one splat over pixels; (i, j) is the offset from the block's centre.
struct Moments {
    float g, gi, gii, gj, gij, gjj, opacity, exponent, depth;
    vec3 colour;
};

float over_parts(float v) {
    if (PARTS > 4u) v += subgroupShuffleXor(v, SPLATS * 4u);
    if (PARTS > 2u) v += subgroupShuffleXor(v, SPLATS * 2u);
    if (PARTS > 1u) v += subgroupShuffleXor(v, SPLATS);
    return v;
}

// Sums over a part of a row of pairs; i is counted from the part's middle.
struct RowSums {
    float both, both_i, both_ii, lower, lower_i;  // sums of G: of both pixels, and of the lower one
};

// z: the splat's depth, with DEPTH_SPREAD.
void add_pair(inout RowSums s, inout Moments m, uint share, uint colour, float i, float z) {
    const vec4 shares = pair_shares[share], c = pair_colour[colour];
    const vec2 rest = pair_colour_rest[colour];
    const float both = shares.x + shares.z;
    s.both += both;
    s.both_i += both * i;
    s.both_ii += both * (i * i);
    s.lower += shares.z;
    s.lower_i += shares.z * i;
    m.colour += shares.y * c.rgb;
    m.colour += shares.w * vec3(c.a, rest);
    if (DEPTH_SUM == 1) {
        vec2 by_depth = pair_depth[colour];
        if (DEPTH_SPREAD == 1) by_depth += 2.0 * (z - pair_first_depth[colour]) * pair_square[colour];
        m.depth += dot(shares.yw, by_depth);
    }
    if (!LOG_FORM) {
        const vec4 more = pair_more[share];
        m.opacity += more.x + more.z;
        if (SHAPED) m.exponent += more.y + more.w;
    }
}

// The sums of the lane's splat of the batch over the block's pixels. All lanes of a splat get the same.
Moments sum_pixels() {
    const uint splat = gl_SubgroupInvocationID % SPLATS, part = gl_SubgroupInvocationID / SPLATS;
    const bool halves = COLUMNS_OF_PART == 4u;  // parts are half rows
    const uint first_pair = halves ? part * 4u : part * ROWS_OF_PART * 8u;
    const uint shares = (gl_SubgroupID * SPLATS + splat) * PAIR_STRIDE + first_pair;
    const uint colours = gl_SubgroupID * PAIRS + first_pair;
    const float first_j = float(first_pair / 8u) - 3.5, middle = halves ? float(part & 1u) * 4.0 - 2.0 : 0.0;
    float z = 0.0;
    if (DEPTH_SPREAD == 1) z = load_record(records_base() + splat * RECORD).depth;
    Moments m = Moments(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, vec3(0.0));
    for (uint row = 0u; row < ROWS_OF_PART; ++row) {
        RowSums s = RowSums(0.0, 0.0, 0.0, 0.0, 0.0);
        [[unroll]] for (uint c = 0u; c < COLUMNS_OF_PART; ++c)
            add_pair(s, m, shares + row * 8u + c, colours + row * 8u + c, float(c) - (halves ? 1.5 : 3.5), z);
        if (halves) {
            s.both_ii += middle * (2.0 * s.both_i + middle * s.both);
            s.both_i += middle * s.both;
            s.lower_i += middle * s.lower;
        }
        const float j = first_j + float(row);  // row of the upper pixels; the lower ones have j + 4
        m.g += s.both;
        m.gi += s.both_i;
        m.gii += s.both_ii;
        m.gj += j * s.both + 4.0 * s.lower;
        m.gij += j * s.both_i + 4.0 * s.lower_i;
        m.gjj += (j * j) * s.both + (8.0 * j + 16.0) * s.lower;
    }
    m.g = over_parts(m.g);
    m.gi = over_parts(m.gi);
    m.gii = over_parts(m.gii);
    m.gj = over_parts(m.gj);
    m.gij = over_parts(m.gij);
    m.gjj = over_parts(m.gjj);
    m.colour = vec3(over_parts(m.colour.r), over_parts(m.colour.g), over_parts(m.colour.b));
    if (!LOG_FORM) m.opacity = over_parts(m.opacity);
    if (!LOG_FORM && SHAPED) m.exponent = over_parts(m.exponent);
    if (DEPTH_SUM == 1) m.depth = over_parts(m.depth);
    return m;
}

// The sums of splat_sums.glsl, times the opacity, from the moments: x = x0 - l11 i - l21 j, dy = dy0 - j.
void store_sums(Record r, Moments m) {
    const float weight = LOG_FORM ? -0.5 : r.strength, inverse = LOG_FORM ? 1.0 / FACTOR_SCALE : 1.0;
    const float x0 = r.centre.x, dy0 = r.centre.y / r.l22;
    const float lean = r.l11 * m.gi + r.l21 * m.gj;
    const float gx = x0 * m.g - lean;
    const float gxx = x0 * (gx - lean) + (r.l11 * r.l11 * m.gii + 2.0 * r.l11 * r.l21 * m.gij + r.l21 * r.l21 * m.gjj);
    const float gxj = x0 * m.gj - (r.l11 * m.gij + r.l21 * m.gjj);
    const float gdy = dy0 * m.g - m.gj;
    const uint place = gl_SubgroupID * CHUNK + r.number - 1u - chunk_begin;
    chunk_halves[2u * place] = weight * vec4(inverse * gx, inverse * inverse * gxx, inverse * (dy0 * gx - gxj), gdy);
    chunk_halves[2u * place + 1u] = vec4(LOG_FORM ? m.g * r.exponent : m.opacity, m.colour);
    chunk_others[OTHERS * place] = weight * (dy0 * (gdy - m.gj) + m.gjj);
    if (DEPTH_SUM == 1) chunk_others[OTHERS * place + 1u] = m.depth;
    if (SHAPED) chunk_others[OTHERS * place + RESTS] = LOG_FORM ? 0.0 : r.strength * m.exponent;
}

// Walks as many intersections from `begin` on as there are lanes, those before `end` that touch the block, last to
// first.
void walk_stretch(inout Pixels px, uint begin, uint end, uint bits, vec2 centre) {
    const uint j = begin + gl_SubgroupInvocationID;
    uint word = 0u;
    if (j < end) word = splat_from_intersection[intersection_from_sorted[j]];
    const bool hit = (word & bits) != 0u;
    const uvec4 hits = subgroupBallot(hit);
    const uint count = subgroupBallotBitCount(hits);
    if (count == 0u) return;
    const uint rank = count - 1u - subgroupBallotExclusiveBitCount(hits);  // counted from the last
    const Record mine = make_record(word & INTERSECTION_SPLAT_MASK, j + 1u, centre);  // splat 0 where nothing hits
    uint done = 0u;
    do {
        const uint size = min(count - done, SPLATS);
        order_within_subgroup();  // other lanes may still read records and numbers
        if (hit && rank - done < SPLATS) {
            store_record(records_base() + (rank - done) * RECORD, mine);
#ifdef HALF_BLEND
            store_half_record(half_records_base() + (rank - done) * HALF_RECORD, mine);
#endif
        }
        order_within_subgroup();
        visit_batch(px, size);
        order_within_subgroup();
        const Moments m = sum_pixels();
        if (gl_SubgroupInvocationID < size)
            store_sums(load_record(records_base() + gl_SubgroupInvocationID * RECORD), m);
        done += SPLATS;
    } while (done < count);
}

#include "backward/team_chunk.glsl"

bool has_sums(uint area, uint local) {
    return (chunk_word[local] & area_bits(area)) != 0u && chunk_begin + local < area_end[area];
}

// One thread for each half of an intersection's partials, and one for each sum beside them.
void store_chunk(uint end) {
    const uint count = min(end - chunk_begin, CHUNK);
    for (uint i = gl_LocalInvocationIndex; i < count * (2u + OTHERS); i += THREADS) {
        if (i < 2u * count) {
            const uint local = i / 2u;
            vec4 sum = vec4(0.0);
            [[unroll]] for (uint area = 0u; area < TEAM; ++area)
                if (has_sums(area, local)) sum += chunk_halves[2u * (area * CHUNK + local) + i % 2u];
            put_four(chunk_slot[local], i % 2u, sum);
        } else {
            const uint local = (i - 2u * count) / OTHERS, value = (i - 2u * count) % OTHERS;
            float sum = 0.0;
            [[unroll]] for (uint area = 0u; area < TEAM; ++area)
                if (has_sums(area, local)) sum += chunk_others[OTHERS * (area * CHUNK + local) + value];
            if (!SHAPED || value < RESTS)
                partial_rest[RESTS * chunk_slot[local] + value] = sum;
            else
                partial_exponent[chunk_slot[local]] = sum;
        }
    }
}

void main() {
    const uvec2 tile = own_tile();
    const uvec2 range = list_part(tile_range[tile.y * args.tiles_x + tile.x]);
    if (range.x >= range.y) return;
    const uint area = gl_SubgroupID;
    const uvec2 first = tile * TILE_SIZE + first_pixel(area, gl_SubgroupInvocationID);
    const vec2 centre = block_centre(tile, area);
    Pixels px;
    const uint last = subgroupMax(load_pixels(first, px));
    const uint own_end = min(last, range.y);
    if (gl_SubgroupInvocationID == 0u) area_end[area] = own_end;
    if (SEGMENT > 0u && last > range.y) load_behind(px, first);
    put_colours(px);
    chunk_begin = range.x + (range.y - 1u - range.x) / CHUNK * CHUNK;
    for (;; chunk_begin -= CHUNK) {
        load_chunk(range.y);
        [[dont_unroll]] for (uint stretch = CHUNK; stretch > 0u;) {
            stretch -= SUBGROUP_SIZE;
            if (chunk_begin + stretch < own_end)
                walk_stretch(px, chunk_begin + stretch, own_end, area_bits(area), centre);
        }
        barrier();
        store_chunk(range.y);
        if (chunk_begin == range.x) break;
        barrier();
    }
    if (SEGMENT > 0u && args.segment > 0u && own_end > range.x) store_state(px, first);
}
