// SPDX-License-Identifier: MIT
// Strict reading of one object of a JSON file: each value is asked for by its key, with its type
// and limits, and a key that nobody asked for is an error, as it is misspelt or of a newer version.
#pragma once

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace darb {

class JsonFields {
  public:
    /// where: the file and the place in it, for messages, as "edits.json: edits[3]". hint: what a
    /// user can do about a mistake. Throws Error where `json` is no object. json must outlive this.
    JsonFields(const nlohmann::json& json, std::string where, std::string hint);

    bool has(const char* key) const { return json_.contains(key); }
    /// Throws Error, naming the key, where it is missing, of another type or beyond the limits.
    double number(const char* key, double low, double high);
    double number_or(const char* key, double low, double high, double otherwise);
    /// Any finite number.
    double number(const char* key);
    std::string text(const char* key);
    std::string text_or(const char* key, const std::string& otherwise);
    bool flag_or(const char* key, bool otherwise);
    /// `count` finite numbers.
    std::vector<double> numbers(const char* key, std::size_t count);
    glm::dvec3 vector(const char* key);
    /// Rows of three.
    glm::dmat3 matrix(const char* key);
    /// A list of vectors of `size` finite numbers, at least `least` of them.
    std::vector<std::vector<double>> rows(const char* key, std::size_t size, std::size_t least);
    /// A list, empty where it is missing.
    const nlohmann::json& list(const char* key);
    /// An object.
    JsonFields object(const char* key);

    /// The place of a key, or of an entry of its list.
    std::string place(const char* key) const { return where_ + ": " + key; }
    std::string place(const char* key, std::size_t entry) const;
    const std::string& where() const { return where_; }
    const std::string& hint() const { return hint_; }
    /// Throws Error where a key was not asked for.
    void done() const;
    [[noreturn]] void refuse(const char* key, const std::string& reason) const;

  private:
    const nlohmann::json& value(const char* key);

    const nlohmann::json& json_;
    std::string where_, hint_;
    std::set<std::string> asked_;
};

/// For writing: as vector() and matrix() read them.
nlohmann::json json_of(const glm::dvec3& v);
nlohmann::json json_of(const glm::dmat3& m);

struct Similarity;
nlohmann::json json_of(const Similarity& s);
/// Of the keys "scale", "turn" or "degrees", "move" and "about", each of which may be missing.
Similarity similarity_in(JsonFields fields);

}  // namespace darb
