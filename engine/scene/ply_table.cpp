// SPDX-License-Identifier: MIT
#include "engine/scene/ply_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/core/text.h"

namespace darb {

static_assert(std::endian::native == std::endian::little);

namespace {

constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;
constexpr std::size_t kMostShown = 40;                  // bytes of a word
constexpr std::size_t kMostFirstLine = 100;             // bytes
constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf";  // byte order mark before UTF-8 text
constexpr std::size_t kProgressRows = 1 << 16;          // between two reports
std::size_t type_size(PlyType type) {
    switch (type) {
        case PlyType::int8:
        case PlyType::uint8:
            return 1;
        case PlyType::int16:
        case PlyType::uint16:
            return 2;
        case PlyType::int32:
        case PlyType::uint32:
        case PlyType::float32:
            return 4;
        case PlyType::float64:
            return 8;
    }
    return 0;
}

std::optional<PlyType> type_from_name(std::string_view name) {
    if (name == "char" || name == "int8") return PlyType::int8;
    if (name == "uchar" || name == "uint8") return PlyType::uint8;
    if (name == "short" || name == "int16") return PlyType::int16;
    if (name == "ushort" || name == "uint16") return PlyType::uint16;
    if (name == "int" || name == "int32") return PlyType::int32;
    if (name == "uint" || name == "uint32") return PlyType::uint32;
    if (name == "float" || name == "float32") return PlyType::float32;
    if (name == "double" || name == "float64") return PlyType::float64;
    return std::nullopt;
}

template <class T>
double load(const std::byte* from, bool swap) {
    std::byte bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = from[swap ? sizeof(T) - 1 - i : i];
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return static_cast<double>(value);
}

double load_value(const std::byte* from, PlyType type, bool swap) {
    switch (type) {
        case PlyType::int8:
            return load<std::int8_t>(from, swap);
        case PlyType::uint8:
            return load<std::uint8_t>(from, swap);
        case PlyType::int16:
            return load<std::int16_t>(from, swap);
        case PlyType::uint16:
            return load<std::uint16_t>(from, swap);
        case PlyType::int32:
            return load<std::int32_t>(from, swap);
        case PlyType::uint32:
            return load<std::uint32_t>(from, swap);
        case PlyType::float32:
            return load<float>(from, swap);
        case PlyType::float64:
            return load<double>(from, swap);
    }
    return 0;
}

std::vector<std::string_view> split_words(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t at = 0; at < line.size();) {
        const std::size_t begin = line.find_first_not_of(" \t\r", at);
        if (begin == std::string_view::npos) break;
        const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        at = end;
    }
    return words;
}

std::uint64_t parse_count(std::string_view word, const std::string& where, std::string_view line) {
    std::uint64_t count = 0;
    const auto [end, error] = parse_number(word.data(), word.data() + word.size(), count);
    if (error != std::errc{} || end != word.data() + word.size())
        throw Error(where, fmt::format("header line '{}' has no valid count", line), kCopyAgain);
    return count;
}

PlyType parse_type(std::string_view word, const std::string& where) {
    const std::optional<PlyType> type = type_from_name(word);
    if (!type)
        throw Error(where, fmt::format("header names the unknown type '{}'", word),
                    "PLY knows char, uchar, short, ushort, int, uint, float and double: export the "
                    "file again with these.");
    return *type;
}

void parse_format(const std::vector<std::string_view>& words, PlyHeader& header,
                  const std::string& where) {
    const std::string_view name = words.size() > 1 ? words[1] : "";
    if (name == "ascii")
        header.format = PlyFormat::ascii;
    else if (name == "binary_little_endian")
        header.format = PlyFormat::little_endian;
    else if (name == "binary_big_endian")
        header.format = PlyFormat::big_endian;
    else
        throw Error(where, fmt::format("header has the unknown format '{}'", name),
                    "Export it as ascii, binary_little_endian or binary_big_endian.");
}

PlyProperty parse_property(const std::vector<std::string_view>& words, const std::string& where,
                           std::string_view line) {
    PlyProperty property;
    property.is_list = words.size() == 5 && words[1] == "list";
    if (!property.is_list && words.size() != 3)
        throw Error(where, fmt::format("header line '{}' is no property", line), kCopyAgain);
    property.name = words.back();
    property.type = parse_type(words[words.size() - 2], where);
    if (property.is_list) property.count_type = parse_type(words[2], where);
    return property;
}

/// Parses a line of the header; returns whether it names the format.
bool parse_header_line(std::string_view line, PlyHeader& header, const std::string& where) {
    const std::vector<std::string_view> words = split_words(line);
    if (words.empty() || words[0] == "obj_info") return false;
    if (words[0] == "comment") {
        const std::size_t begin = line.find("comment") + 7;
        const std::size_t text = line.find_first_not_of(" \t", begin);
        const std::size_t last = line.find_last_not_of(" \t\r");
        header.comments.emplace_back(text == std::string_view::npos || last < text
                                         ? ""
                                         : line.substr(text, last + 1 - text));
    } else if (words[0] == "format") {
        parse_format(words, header, where);
        return true;
    } else if (words[0] == "element" && words.size() == 3) {
        header.elements.push_back({std::string(words[1]), parse_count(words[2], where, line), {}});
    } else if (words[0] == "property" && !header.elements.empty()) {
        header.elements.back().properties.push_back(parse_property(words, where, line));
    } else {
        throw Error(where, fmt::format("header line '{}' is not understood", line), kCopyAgain);
    }
    return false;
}

/// Least size of a row; a list counts with its length field only (binary) or one word (ascii).
std::uint64_t least_row_bytes(const PlyElement& element, PlyFormat format) {
    if (format == PlyFormat::ascii) return 2 * element.properties.size();
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : element.properties)
        bytes += type_size(property.is_list ? property.count_type : property.type);
    return bytes;
}

/// Walks the data part, one row at a time.
class RowReader {
  public:
    RowReader(std::span<const std::byte> file, const PlyHeader& header, const std::string& where)
        : file_(file), at_(header.data_begin), format_(header.format), where_(where) {}

    void read(const PlyElement& element, std::size_t row, double* values, const PlyList& list) {
        const std::size_t begin = format_ == PlyFormat::ascii ? next_text() : at_;
        for (std::size_t c = 0; c < element.properties.size(); ++c) {
            const PlyProperty& property = element.properties[c];
            values[c] = next(element, row, property.is_list ? property.count_type : property.type);
            if (!property.is_list) continue;
            read_list(element, row, property, values[c], static_cast<bool>(list));
            values[c] = 0;
            if (list) list(row, c, list_);
        }
        check_line(element, row, begin);
    }

    std::size_t at() const { return at_; }

  private:
    [[noreturn]] void fail(const PlyElement& element, std::size_t row, const char* reason) const {
        throw Error(
            where_,
            fmt::format("element {}, row {} of {}: {}", element.name, row, element.count, reason),
            kCopyAgain);
    }

    double next(const PlyElement& element, std::size_t row, PlyType type) {
        if (format_ == PlyFormat::ascii) return next_word(element, row);
        const std::size_t size = type_size(type);
        if (file_.size() - at_ < size) fail(element, row, "the file ends here");
        const double value = load_value(file_.data() + at_, type, format_ == PlyFormat::big_endian);
        at_ += size;
        return value;
    }

    double next_word(const PlyElement& element, std::size_t row) {
        const char* text = reinterpret_cast<const char*>(file_.data());
        const auto is_space = [](char c) {
            return c == ' ' || c == '\n' || c == '\r' || c == '\t';
        };
        while (at_ < file_.size() && is_space(text[at_])) ++at_;
        if (at_ == file_.size()) fail(element, row, "the file ends here");
        if (text[at_] == '+') ++at_;
        double value = 0;
        const auto [end, error] = parse_number(text + at_, text + file_.size(), value);
        if (error == std::errc::invalid_argument) fail_at_word(element, row);
        if (error == std::errc::result_out_of_range)  // too small: about 0; too large: infinite
            value = std::strtod(std::string(text + at_, end).c_str(), nullptr);
        at_ = static_cast<std::size_t>(end - text);
        if (at_ < file_.size() && !is_space(text[at_])) fail_at_word(element, row);
        return value;
    }

    /// Throws because the word at at_ is not a number; says in which line, and what it looks like.
    [[noreturn]] void fail_at_word(const PlyElement& element, std::size_t row) const {
        const std::string_view text(reinterpret_cast<const char*>(file_.data()), file_.size());
        constexpr const char* kBlanks = " \t\r\n";
        const std::size_t before = text.find_last_of(kBlanks, at_ > 0 ? at_ - 1 : 0);
        const std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
        const std::string_view word =
            text.substr(begin, std::min(text.find_first_of(kBlanks, at_), text.size()) - begin);
        const auto commas = std::count(word.begin(), word.end(), ',');
        const std::string place = fmt::format(
            "line {}, row {} of {} of element {}: '{}'",
            1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at_), '\n'),
            row, element.count, element.name, printable(word.substr(0, kMostShown)));
        if (commas == 1 && word.find('.') == std::string_view::npos && word.back() != ',')
            throw Error(where_, place + " has a decimal comma",
                        "Export it with decimal points, or replace the commas behind the header: "
                        "sed '/^end_header/,$ s/,/./g' IN.ply > OUT.ply");
        if (commas > 0)
            throw Error(where_, place + " has commas between numbers",
                        "Export it with blanks between them, or replace the commas behind the "
                        "header: sed '/^end_header/,$ s/,/ /g' IN.ply > OUT.ply");
        throw Error(where_, place + " is not a number", kCopyAgain);
    }

    /// Whether only blanks are left before the end of the line (or of the file).
    bool at_line_end() const {
        const char* text = reinterpret_cast<const char*>(file_.data());
        std::size_t at = at_;
        while (at < file_.size() && (text[at] == ' ' || text[at] == '\t')) ++at;
        return at == file_.size() || text[at] == '\n' || text[at] == '\r';
    }
    std::size_t next_text() const {
        const char* text = reinterpret_cast<const char*>(file_.data());
        std::size_t at = at_;
        while (at < file_.size() && std::strchr(" \t\r\n", text[at]) && text[at] != 0) ++at;
        return at;
    }

    /// A row with another length than the header declares would shift everything after it. Where
    /// the first row is one line, all must be. A file that breaks its lines elsewhere is read word
    /// by word.
    void check_line(const PlyElement& element, std::size_t row, std::size_t begin) {
        if (format_ != PlyFormat::ascii) return;
        const std::string_view all(reinterpret_cast<const char*>(file_.data()), file_.size());
        const bool whole =
            all.substr(begin, at_ - begin).find_first_of("\r\n") == std::string_view::npos;
        const bool is_line = whole && at_line_end();
        const std::string_view line =
            all.substr(begin, std::min(all.find_first_of("\r\n", begin), all.size()) - begin);
        if (row == 0) {
            rows_are_lines_ = is_line;
            const std::size_t columns = element.properties.size();
            if (at_line_end() || (whole && split_words(line).size() % columns == 0)) return;
        }
        if (is_line || (row > 0 && !rows_are_lines_)) return;
        const auto before = all.begin() + static_cast<std::ptrdiff_t>(begin);
        throw Error(
            where_,
            fmt::format("line {}, row {} of {} of element {}: has {} values, and the header "
                        "declares {} properties",
                        1 + std::count(all.begin(), before, '\n'), row, element.count, element.name,
                        split_words(line).size(), element.properties.size()),
            "Correct the header or the line, or export the file again.");
    }

    /// keep: into list_; else the list is only passed over.
    void read_list(const PlyElement& element, std::size_t row, const PlyProperty& property,
                   double length, bool keep) {
        if (!(length >= 0)) fail(element, row, "a list has a negative length");
        const std::size_t size = format_ == PlyFormat::ascii ? 1 : type_size(property.type);
        const std::uint64_t most = (file_.size() - at_) / size;
        if (length > static_cast<double>(most))
            fail(element, row, "a list is longer than the file");
        list_.clear();
        if (!keep && format_ != PlyFormat::ascii) {
            at_ += static_cast<std::size_t>(length) * size;
            return;
        }
        for (auto left = static_cast<std::size_t>(length); left > 0; --left) {
            const double value = next(element, row, property.type);
            if (keep) list_.push_back(value);
        }
    }

    std::vector<double> list_;  // the last that was kept
    std::span<const std::byte> file_;
    bool rows_are_lines_ = false;
    std::size_t at_;
    PlyFormat format_;
    const std::string& where_;
};

}  // namespace

int PlyElement::find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == property) return static_cast<int>(i);
    return -1;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
    for (const PlyElement& candidate : elements)
        if (candidate.name == element) return &candidate;
    return nullptr;
}

bool looks_like_ply(std::span<const std::byte> file) {
    std::string_view text(reinterpret_cast<const char*>(file.data()),
                          std::min(file.size(), kMostFirstLine));
    if (text.starts_with(kUtf8Mark)) text.remove_prefix(kUtf8Mark.size());
    if (!text.starts_with("ply")) return false;
    const std::size_t end = text.find_first_not_of(" \t", 3);
    return end != std::string_view::npos && (text[end] == '\n' || text[end] == '\r');
}

PlyHeader parse_ply_header(std::span<const std::byte> file, const std::string& where) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()),
                                std::min(file.size(), kMaxHeaderBytes));
    if (!looks_like_ply(file))
        throw Error(where, "is no PLY file: it does not begin with 'ply'", "Check the path.");
    // Files of old programs end lines with a bare carriage return.
    const std::size_t first = text.find_first_of("\r\n");
    const bool returns =
        text.substr(first).size() > 1 && text[first] == '\r' && text[first + 1] != '\n';
    const char line_end = returns ? '\r' : '\n';
    PlyHeader header;
    bool has_format = false;
    for (std::size_t begin = text.find(line_end) + 1;;) {
        const std::size_t end = text.find(line_end, begin);
        if (begin == 0 || end == std::string_view::npos)
            throw Error(where, "the header has no end_header line", kCopyAgain);
        std::string_view line = text.substr(begin, end - begin);
        while (line.ends_with('\r') || line.ends_with(' ') || line.ends_with('\t'))
            line.remove_suffix(1);
        begin = end + 1;
        if (line == "end_header") {
            if (!has_format) throw Error(where, "the header has no format line", kCopyAgain);
            header.data_begin = begin;
            return header;
        }
        has_format |= parse_header_line(line, header, where);
    }
}

void check_ply_size(std::span<const std::byte> file, const PlyHeader& header,
                    const PlyElement& element, const std::string& where) {
    std::uint64_t left = file.size() - header.data_begin;
    for (const PlyElement& candidate : header.elements) {
        if (candidate.properties.empty() && &candidate != &element) continue;
        const std::uint64_t row = least_row_bytes(candidate, header.format);
        // The last ascii row may lack its line break.
        const std::uint64_t slack = header.format == PlyFormat::ascii ? 1 : 0;
        if (candidate.count > 0 && (row == 0 || candidate.count > (left + slack) / row))
            throw Error(where,
                        fmt::format("declares {} rows of element {} of at least {} bytes each, but "
                                    "holds {} bytes for them",
                                    candidate.count, candidate.name, row, left),
                        "The file is cut off or damaged: export or copy it again.");
        left -= std::min(left, candidate.count * row);
        if (&candidate == &element) return;
    }
}

std::size_t read_ply_rows(std::span<const std::byte> file, const PlyHeader& header,
                          const PlyElement& element, const std::string& where, const PlyRow& row,
                          const ReadProgress& progress, const PlyList& list) {
    check_ply_size(file, header, element, where);
    RowReader reader(file, header, where);
    for (const PlyElement& candidate : header.elements) {
        if (candidate.properties.empty()) continue;  // takes no bytes, however many rows it has
        std::vector<double> values(candidate.properties.size());
        const bool wanted = &candidate == &element;
        const PlyList lists = wanted ? list : PlyList{};
        for (std::size_t i = 0; i < candidate.count; ++i) {
            if (wanted && progress && i % kProgressRows == 0)
                progress(static_cast<double>(i) / static_cast<double>(candidate.count));
            reader.read(candidate, i, values.data(), lists);
            if (wanted) row(i, values.data());
        }
        if (wanted) break;
    }
    return reader.at();
}

std::string ply_bytes_behind(std::span<const std::byte> file, const PlyHeader& header,
                             const PlyElement& element, std::size_t end) {
    if (header.elements.empty() || &header.elements.back() != &element) return {};
    std::string_view rest(reinterpret_cast<const char*>(file.data()) + end, file.size() - end);
    if (header.format == PlyFormat::ascii) {
        const std::size_t text = rest.find_first_not_of(" \t\r\n");
        rest.remove_prefix(std::min(text, rest.size()));
    }
    if (rest.empty()) return {};
    return fmt::format("its header declares {} rows of {}; the {} bytes behind them were left out",
                       element.count, element.name, rest.size());
}

}  // namespace darb
