#include "engine/scene/ply.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply_comments.h"
#include "engine/scene/ply_dialects.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_shapes.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

namespace {

// float32 is what the model stores.
float stored(const double* values, const PlyColumns& columns, std::size_t a, std::size_t c) {
    const auto value = static_cast<float>(values[columns.of[a][c]]);
    const auto limit = kSplatAttributes[a].from_file;
    return limit ? limit(value) : value;
}

bool all_finite(const double* values, const PlyColumns& columns) {
    for (std::size_t a = 0; a < kAttributeCount; ++a)
        for (std::size_t c = 0; c < columns.of[a].size(); ++c)
            if (!std::isfinite(stored(values, columns, a, c))) return false;
    return true;
}

// A column that is named as shapes are, of a kernel that has none.
void drop_shapes_of_others(int kernel, PlyColumns& columns) {
    if (columns.foreign_beta || columns.of[kShape].empty() || kernel_takes(kernel, kShape)) return;
    columns.of[kShape].clear();
    columns.unread.push_back(ply_column(kShape, 0));
}

// Positions are set later, all at once.
void store_splat(const double* values, const PlyColumns& columns, std::size_t at,
                 SplatModel& model) {
    for (std::size_t a = 0; a < kAttributeCount; ++a) {
        if (a == kPosition) continue;
        const std::size_t floats = columns.of[a].size();
        float* to = attribute_values(model, static_cast<int>(a)).data() + at * floats;
        for (std::size_t c = 0; c < floats; ++c) to[c] = stored(values, columns, a, c);
    }
}

std::string make_header(const SplatModel& model, bool double_positions) {
    std::string text = fmt::format("ply\nformat binary_little_endian 1.0\n{}element vertex {}\n",
                                   ply_comments(model), model.size());
    for (const int a : attributes_in_file_order()) {
        const bool wide = double_positions && a == kPosition;
        for (std::size_t c = 0; c < model.floats(a); ++c)
            text += fmt::format("property {} {}\n", wide ? "double" : "float", ply_column(a, c));
        if (a != kPosition) continue;
        for (const char* name : {"nx", "ny", "nz"})
            text += fmt::format("property float {}\n", name);
    }
    return text + "end_header\n";
}

template <class T>
std::byte* put(std::byte* to, const T* values, std::size_t count) {
    if (count > 0) std::memcpy(to, values, count * sizeof(T));  // values may be null without any
    return to + count * sizeof(T);
}

std::byte* put_position(std::byte* to, const SplatModel& model, std::size_t splat, bool doubles) {
    for (std::size_t i = 0; i < 3; ++i) {
        const float local = model.position[splat * 3 + i];
        const double origin = model.origin[static_cast<int>(i)], value = origin + double{local};
        // Adding a zero origin would turn -0 into 0.
        const float narrow = origin == 0.0 ? local : static_cast<float>(value);
        to = doubles ? put(to, &value, 1) : put(to, &narrow, 1);
    }
    constexpr float kNoNormal[3] = {0, 0, 0};
    return put(to, kNoNormal, 3);
}

std::byte* put_row(std::byte* to, const SplatModel& model, int attribute, std::size_t splat) {
    const std::size_t floats = model.floats(attribute);
    const float* from = attribute_values(model, attribute).data() + splat * floats;
    if (!kSplatAttributes[static_cast<std::size_t>(attribute)].per_coefficient)
        return put(to, from, floats);
    for (std::size_t c = 0; c < floats; ++c)
        put(to + file_column(attribute, model.sh_degree, c) * sizeof(float), from + c, 1);
    return to + floats * sizeof(float);
}

std::string encoding_of(const PlyHeader& header) {
    if (header.format == PlyFormat::ascii) return "ascii";
    return header.format == PlyFormat::big_endian ? "binary, big-endian" : "binary, little-endian";
}

// What these programs write is in logarithms and logits, and reading it takes them for that.
void refuse_units(const PlyHeader& header, const SplatSource& source) {
    const PlyElement* vertex = header.find("vertex");
    const bool changed =
        source.units.scales != StoredScales{} || source.units.opacities != StoredOpacities{};
    if (!vertex || !changed || (vertex->find("filter_3D") < 0 && vertex->find("sh0_0") < 0)) return;
    throw Error(source.where,
                "is a scene of Mip-Splatting or Deformable Beta Splatting, whose scales are "
                "logarithms and whose opacities are logits",
                "Leave out --scales and --opacities.");
}

// Compressed PLY too.
SplatModel load_ply(const SplatSource& source, SplatFile& file) {
    const PlyHeader header = parse_ply_header(source.bytes, source.where);
    if (is_compressed_ply(header)) file.format = SplatFormat::compressed_ply;
    file.details = encoding_of(header);
    const bool points = is_point_cloud(header);
    if (points && source.read_points) return source.read_points(header);
    if (points)
        throw Error(source.where,
                    "is a point cloud: its vertices have no opacity, scale and rotation",
                    "darb train starts from it where it lies beside the cameras; a viewer shows it "
                    "as points.");
    refuse_units(header, source);
    PlyFacts facts;
    SplatModel model = parse_ply(source.bytes, header, source.where, &facts, source.progress);
    file.dropped = facts.dropped;
    file.notes = facts.notes;
    file.up = facts.up;
    file.position_step = facts.position_step;
    return model;
}

void said_of_foreign_shapes(std::size_t held, PlyFacts* facts) {
    if (!facts) return;
    facts->notes.push_back(
        "is a scene of Deformable Beta Splatting: drawn with the kernel beta (exact)");
    if (held > 0)
        facts->notes.push_back(
            fmt::format("{} of its exponents lie outside of {} to {} and are held there", held,
                        BETA_EXPONENT_LEAST, BETA_EXPONENT_MOST));
}

std::vector<std::string> ply_losses(const SplatModel& model, const std::string&) {
    if (!needs_double_positions(model)) return {};
    const glm::dvec3 to_0 = 0.0 - model.origin;
    return {fmt::format(
        "positions are written as double, which few other programs read, as float32 does not "
        "resolve them: --translate {},{},{} brings the scene to 0",
        to_0.x, to_0.y, to_0.z)};
}

std::size_t floats_in_all(const SplatModel& model) {
    std::size_t sum = 0;
    for (int a = 0; a < kAttributeCount; ++a) sum += model.floats(a);
    return sum;
}

}  // namespace

SplatModel parse_ply(std::span<const std::byte> file, const std::string& where, PlyFacts* facts,
                     const ReadProgress& progress) {
    return parse_ply(file, parse_ply_header(file, where), where, facts, progress);
}

SplatModel parse_ply(std::span<const std::byte> file, const PlyHeader& header,
                     const std::string& where, PlyFacts* facts, const ReadProgress& progress) {
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A splat scene is needed.");
    if (is_compressed_ply(header))
        return parse_compressed_ply(file, header, where, facts, progress);
    PlyColumns columns = find_ply_columns(*vertex, where);
    check_ply_size(file, header, *vertex, where);

    SplatModel model;
    PlyFacts said;
    model.sh_degree =
        static_cast<int>(std::lround(std::sqrt(columns.of[kShRest].size() / 3 + 1))) - 1;
    read_ply_comments(header, where, model, said.notes);
    said.up = stated_up(header);
    drop_shapes_of_others(model.kernel, columns);
    const bool foreign = columns.foreign_beta;  // a scene of Deformable Beta Splatting
    if (foreign) {
        model.kernel = KERNEL_BETA;
        model.footprint = Footprint::exact;
    }
    for (std::size_t a = 0; a < kAttributeCount; ++a)
        attribute_values(model, static_cast<int>(a)).resize(vertex->count * columns.of[a].size());
    std::vector<double> positions, translated;
    positions.reserve(vertex->count * 3);
    std::size_t kept = 0;
    bool has_normals = false;
    const PlyRow row = [&](std::size_t, const double* read) {
        const double* values = translate_row(columns, read, translated);
        for (const int column : columns.normal) has_normals |= values[column] != 0;
        if (!all_finite(values, columns)) return;
        for (const int column : columns.of[kPosition]) positions.push_back(values[column]);
        store_splat(values, columns, kept++, model);
    };
    const std::size_t end = read_ply_rows(file, header, *vertex, where, row, progress);
    if (facts) {
        const std::string behind = ply_bytes_behind(file, header, *vertex, end);
        if (!behind.empty()) said.notes.push_back(behind);
        const std::vector<std::string> notes = ply_notes(columns, has_normals);
        said.notes.insert(said.notes.end(), notes.begin(), notes.end());
        said.dropped = vertex->count - kept;
        *facts = std::move(said);
    }
    model.resize(kept);
    if (foreign) said_of_foreign_shapes(take_foreign_shapes(model), facts);
    std::vector<std::string> notes;
    settle_shapes(model, notes);
    if (facts) facts->notes.insert(facts->notes.end(), notes.begin(), notes.end());
    set_positions(positions, model);
    return model;
}

SplatModel read_ply(const std::filesystem::path& path) {
    return parse_ply(read_file(path), path.string());
}

bool needs_double_positions(const SplatModel& model) {
    if (model.origin == glm::dvec3(0.0)) return false;
    std::vector<double> positions(model.position.begin(), model.position.end());
    for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] += model.origin[static_cast<int>(i % 3)];
    return origin_for_float32(positions) != glm::dvec3(0.0);
}

std::vector<std::byte> encode_ply(const SplatModel& model) {
    check_splat_shapes(model);
    const bool doubles = needs_double_positions(model);
    const std::string header = make_header(model, doubles);
    const std::size_t row = 3 * (doubles ? 8 : 4) + 3 * 4 + (floats_in_all(model) - 3) * 4;
    std::vector<std::byte> file(header.size() + model.size() * row);
    std::byte* to = put(file.data(), header.data(), header.size());
    for (std::size_t n = 0; n < model.size(); ++n)
        for (const int a : attributes_in_file_order())
            to = a == kPosition ? put_position(to, model, n, doubles) : put_row(to, model, a, n);
    return file;
}

void write_ply(const std::filesystem::path& path, const SplatModel& model) {
    write_file_atomic(path, encode_ply(model));
}

const SplatFormatRow& ply_format() {
    static const SplatFormatRow row{
        .name = "PLY",
        .endings = {".ply"},
        .recognise = [](const SplatSource& source) { return looks_like_ply(source.bytes); },
        .parse = load_ply,
        .encode = [](const SplatModel& model, const std::string&,
                     const EncodeOptions&) { return EncodedSplats{encode_ply(model)}; },
        .keeps = kKeepsKernel | kKeepsRenderMode | kKeepsHarmonics | kKeepsDoublePositions |
                 kKeepsUnturned | kKeepsShape,
        .cuts = ply_losses};
    return row;
}

}  // namespace darb
