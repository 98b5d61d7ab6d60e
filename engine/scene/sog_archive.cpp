#include "engine/scene/sog_archive.h"

#include <fmt/format.h>
#include <webp/decode.h>
#include <zip.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/inflate.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

constexpr time_t kZipTime = 315619200;  // 1980-01-02, so that bytes do not depend on the day

struct CloseArchive {
    void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct CloseEntry {
    void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

std::shared_ptr<zip_t> open_archive(std::span<const std::byte> zip, const std::string& where) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(zip.data(), zip.size(), 0, &error);
    zip_t* archive = source ? zip_open_from_source(source, ZIP_RDONLY, &error) : nullptr;
    if (!archive) {
        const std::string reason = zip_error_strerror(&error);
        zip_source_free(source);
        zip_error_fini(&error);
        throw Error(where, "the zip cannot be opened: " + reason, kCopyAgain);
    }
    zip_error_fini(&error);
    return {archive, CloseArchive{}};
}

std::vector<std::byte> read_entry(zip_t* archive, const std::string& name, std::size_t zip_bytes,
                                  const std::string& where) {
    const std::string place = where + ", entry " + name;
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_stat(archive, name.c_str(), 0, &stat) != 0 || !(stat.valid & ZIP_STAT_SIZE))
        throw Error(place, "the zip has no such entry", kCopyAgain);
    check_expansion(zip_bytes, stat.size, place);
    const std::unique_ptr<zip_file_t, CloseEntry> entry(zip_fopen(archive, name.c_str(), 0));
    if (!entry)
        throw Error(place, std::string("cannot be read: ") + zip_strerror(archive), kCopyAgain);
    std::vector<std::byte> bytes(stat.size);
    std::size_t done = 0;
    while (done < bytes.size()) {
        const zip_int64_t got = zip_fread(entry.get(), bytes.data() + done, bytes.size() - done);
        if (got <= 0)
            throw Error(place, fmt::format("ends after {} of {} bytes", done, bytes.size()),
                        kCopyAgain);
        done += static_cast<std::size_t>(got);
    }
    // The checksum counts where the end is met.
    std::byte beyond{};
    if (const zip_int64_t more = zip_fread(entry.get(), &beyond, 1); more != 0)
        throw Error(place,
                    more < 0 ? fmt::format("is damaged: {}", zip_file_strerror(entry.get()))
                             : "is longer than the zip says",
                    kCopyAgain);
    return bytes;
}

/// Of a scene that has to be unpacked first; empty where there is none.
std::string packed_scene(zip_t* archive) {
    for (zip_int64_t i = 0; i < zip_get_num_entries(archive, 0); ++i)
        if (const char* name = zip_get_name(archive, static_cast<zip_uint64_t>(i), 0))
            if (format_to_write(name)) return name;
    return {};
}

/// meta.json names files beside it, none in other folders.
void check_part_name(const std::string& name, const std::string& meta) {
    if (name.empty() || std::filesystem::path(name).filename() != name || name == "..")
        throw Error(meta, "names '" + name + "', which is no file of its folder",
                    "Put all files of the scene into one folder.");
}

}  // namespace

SogPart open_sog_zip(std::span<const std::byte> zip, const std::string& where) {
    const std::shared_ptr<zip_t> archive = open_archive(zip, where);
    if (zip_name_locate(archive.get(), "meta.json", 0) < 0) {
        const std::string scene = packed_scene(archive.get());
        throw Error(where,
                    "is a zip and no SOG scene: it has no meta.json" +
                        (scene.empty() ? "" : ", and holds " + scene),
                    scene.empty() ? "Name a splat file." : "Unpack it and name that file.");
    }
    return [archive, size = zip.size(), where](const std::string& name) {
        check_part_name(name, where + ", meta.json");
        return read_entry(archive.get(), name, size, where);
    };
}

SogPart open_sog_folder(const std::filesystem::path& folder) {
    return [folder](const std::string& name) {
        check_part_name(name, (folder / "meta.json").string());
        return read_file(folder / name);
    };
}

std::vector<std::byte> make_sog_zip(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& parts,
    const std::string& where) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* const source = zip_source_buffer_create(nullptr, 0, 0, &error);
    zip_t* const archive = source ? zip_open_from_source(source, ZIP_TRUNCATE, &error) : nullptr;
    const auto failed = [&](const char* reason) {
        return Error(where, std::string("the zip cannot be made: ") + reason, "Free memory.");
    };
    if (!archive) {
        zip_source_free(source);
        throw failed("out of memory");
    }
    zip_source_keep(source);
    for (const auto& [name, bytes] : parts) {
        zip_source_t* const part = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
        const zip_int64_t index = part ? zip_file_add(archive, name.c_str(), part, 0) : -1;
        if (index < 0 ||
            zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE, 0) !=
                0 ||
            zip_file_set_mtime(archive, static_cast<zip_uint64_t>(index), kZipTime, 0) != 0) {
            zip_discard(archive);
            zip_source_free(source);
            throw failed("a part cannot be added");
        }
    }
    std::vector<std::byte> file;
    zip_stat_t stat;
    zip_stat_init(&stat);
    if (zip_close(archive) == 0 && zip_source_stat(source, &stat) == 0 &&
        zip_source_open(source) == 0) {
        file.resize(stat.size);
        if (zip_source_read(source, file.data(), file.size()) !=
            static_cast<zip_int64_t>(file.size()))
            file.clear();
        zip_source_close(source);
    }
    zip_source_free(source);
    if (file.empty()) throw failed("its parts do not fit");
    return file;
}

SogImage decode_webp(std::span<const std::byte> bytes, std::size_t most, const std::string& where) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    int width = 0, height = 0;
    if (!WebPGetInfo(data, bytes.size(), &width, &height))
        throw Error(where, "is no WebP picture", kCopyAgain);
    SogImage image{static_cast<std::size_t>(width), static_cast<std::size_t>(height), {}};
    if (image.width * image.height > most)
        throw Error(
            where, fmt::format("is {} x {} px; the splats need {} px at most", width, height, most),
            kCopyAgain);
    image.rgba.resize(4 * image.width * image.height);
    if (!WebPDecodeRGBAInto(data, bytes.size(), image.rgba.data(), image.rgba.size(), 4 * width))
        throw Error(where, "the WebP picture is damaged", kCopyAgain);
    return image;
}

}  // namespace darb
