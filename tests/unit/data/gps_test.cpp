// SPDX-License-Identifier: MIT
#include "engine/data/gps.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

std::string big_endian(std::uint32_t value, int bytes) {
    std::string text;
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
        text += static_cast<char>(value >> shift & 0xFF);
    return text;
}

std::string entry(std::uint32_t tag, std::uint32_t type, std::uint32_t count,
                  const std::string& value) {
    return big_endian(tag, 2) + big_endian(type, 2) + big_endian(count, 4) + value;
}

/// A JPEG's EXIF with this position, as cameras write it: degrees, minutes and hundredths of
/// seconds.
std::string exif_with(const GeoPosition& p) {
    const auto angle = [](double degrees) {
        const double whole = std::abs(degrees);
        const auto d = static_cast<std::uint32_t>(whole);
        const auto m = static_cast<std::uint32_t>((whole - d) * 60);
        const auto s = static_cast<std::uint32_t>(std::lround(((whole - d) * 60 - m) * 60 * 10000));
        return big_endian(d, 4) + big_endian(1, 4) + big_endian(m, 4) + big_endian(1, 4) +
               big_endian(s, 4) + big_endian(10000, 4);
    };
    const std::uint32_t gps = 8 + 2 + 12 + 4, values = gps + 2 + 6 * 12 + 4;
    const auto letter = [](const char* text) {
        return std::string(text) + std::string("\0\0\0", 3);
    };
    std::string tiff = "MM" + big_endian(42, 2) + big_endian(8, 4) + big_endian(1, 2) +
                       entry(0x8825, 4, 1, big_endian(gps, 4)) + big_endian(0, 4);
    tiff += big_endian(6, 2) + entry(1, 2, 2, letter(p.latitude < 0 ? "S" : "N")) +
            entry(2, 5, 3, big_endian(values, 4)) +
            entry(3, 2, 2, letter(p.longitude < 0 ? "W" : "E")) +
            entry(4, 5, 3, big_endian(values + 24, 4)) +
            entry(5, 1, 1, big_endian(p.altitude < 0 ? 1 : 0, 1) + std::string("\0\0\0", 3)) +
            entry(6, 5, 1, big_endian(values + 48, 4)) + big_endian(0, 4);
    tiff += angle(p.latitude) + angle(p.longitude) +
            big_endian(static_cast<std::uint32_t>(std::lround(std::abs(p.altitude) * 1000)), 4) +
            big_endian(1000, 4);
    const std::string segment = std::string("Exif\0\0", 6) + tiff;
    return "\xFF\xE1" + big_endian(static_cast<std::uint32_t>(segment.size() + 2), 2) + segment;
}

std::string photo_with(const GeoPosition& p, int width, int height) {
    const std::vector<std::byte> jpeg = encode_jpeg(ImageU8(width, height, 3), 80);
    const std::string file(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
    return file.substr(0, 2) + exif_with(p) + file.substr(2);
}

std::optional<GeoPosition> position_in(const std::string& file) {
    return exif_position(std::as_bytes(std::span(file)));
}

constexpr GeoPosition kPlace{47.37693, 8.54169, 412};

/// Where a point is that lies so many metres east, north and up of the place.
GeoPosition away(const glm::dvec3& metres) {
    const double radius = 6378137, latitude = glm::radians(kPlace.latitude);
    const double s = std::sin(latitude), e2 = 6.69437999014132e-3, w = 1 - e2 * s * s;
    return {
        kPlace.latitude + glm::degrees(metres.y / (radius * (1 - e2) / std::pow(w, 1.5))),
        kPlace.longitude + glm::degrees(metres.x / (radius / std::sqrt(w) * std::cos(latitude))),
        kPlace.altitude + metres.z};
}

TEST(Gps, exif_positions_are_read) {
    for (const GeoPosition& p : {kPlace, GeoPosition{-33.856784, -70.215297, -12.5}}) {
        const auto read = position_in(photo_with(p, 8, 8));
        ASSERT_TRUE(read);
        EXPECT_NEAR(read->latitude, p.latitude, 1e-7);
        EXPECT_NEAR(read->longitude, p.longitude, 1e-7);
        EXPECT_NEAR(read->altitude, p.altitude, 1e-3);
    }
    EXPECT_FALSE(position_in(photo_with({0, 0, 0}, 8, 8))) << "no fix";
    const std::string file = photo_with(kPlace, 8, 8);
    for (std::size_t size = 0; size < file.size(); ++size) position_in(file.substr(0, size));
    Pcg32 rng(1);
    for (int i = 0; i < 20'000; ++i) {  // damaged: any answer, but nothing outside of the file
        std::string damaged = file;
        damaged[rng.below(static_cast<std::uint32_t>(file.size()))] =
            static_cast<char>(rng.below(256));
        position_in(damaged);
    }
}

/// An APP1 segment as drones write it; attributes, or elements.
std::string drone_xmp(const GeoPosition& p, bool elements, const char* longitude = "GpsLongitude") {
    const auto number = [&](const char* name, double value) {
        return fmt::format(fmt::runtime(elements ? "<drone-dji:{0}>{1:+.9f}</drone-dji:{0}>"
                                                 : " drone-dji:{0}=\"{1:+.9f}\""),
                           name, value);
    };
    const std::string numbers = number("AbsoluteAltitude", p.altitude) +
                                number("RelativeAltitude", p.altitude - 400) +
                                number("GpsLatitude", p.latitude) + number(longitude, p.longitude);
    const std::string text = std::string("http://ns.adobe.com/xap/1.0/\0", 29) +
                             "<rdf:Description" + (elements ? ">" + numbers : numbers + ">") +
                             "</rdf:Description>";
    return "\xFF\xE1" + big_endian(static_cast<std::uint32_t>(text.size() + 2), 2) + text;
}

std::string photo_by_drone(const GeoPosition& p, bool elements,
                           const char* longitude = "GpsLongitude") {
    const std::vector<std::byte> jpeg = encode_jpeg(ImageU8(8, 8, 3), 80);
    const std::string file(reinterpret_cast<const char*>(jpeg.data()), jpeg.size());
    return file.substr(0, 2) + drone_xmp(p, elements, longitude) + file.substr(2);
}

std::optional<GeoPosition> drone_in(const std::string& file) {
    return drone_position(std::as_bytes(std::span(file)));
}

TEST(Gps, positions_of_drones_are_read) {
    for (const bool elements : {false, true})
        for (const char* longitude : {"GpsLongitude", "GpsLongtitude"}) {
            const GeoPosition south{-33.856784, -70.215297, 512.5};
            const auto read = drone_in(photo_by_drone(south, elements, longitude));
            ASSERT_TRUE(read) << longitude;
            EXPECT_NEAR(read->latitude, south.latitude, 1e-8);
            EXPECT_NEAR(read->longitude, south.longitude, 1e-8);
            EXPECT_NEAR(read->altitude, south.altitude, 1e-8);
        }
    std::string file = photo_by_drone(kPlace, false);
    file.replace(file.find("AbsoluteAltitude"), 16, "AbsoluteAltitudX");
    ASSERT_TRUE(drone_in(file));
    EXPECT_NEAR(drone_in(file)->altitude, kPlace.altitude - 400, 1e-8) << "above the start";
    EXPECT_FALSE(drone_in(photo_with(kPlace, 8, 8))) << "no drone";
    EXPECT_FALSE(drone_in(photo_by_drone({0, 0, 400}, false))) << "no fix";
    EXPECT_FALSE(drone_in(photo_by_drone({95, 0, 400}, false)));
    for (std::size_t size = 0; size < file.size(); ++size) drone_in(file.substr(0, size));
}

TEST(Gps, metres_around_a_place) {
    for (const glm::dvec3& metres : {glm::dvec3(100, 0, 0), glm::dvec3(0, -80, 0),
                                     glm::dvec3(0, 0, 30), glm::dvec3(55, 66, -7)})
        EXPECT_NEAR(glm::distance(east_north_up(away(metres), kPlace), metres), 0, 0.01);
}

/// Cameras on a wavy path, and where they were: a world unit is 2.5 m, turned.
struct Flight {
    std::vector<glm::dvec3> centres;
    std::vector<GeoPosition> positions;
    glm::dmat3 rotation =
        glm::mat3_cast(glm::angleAxis(2.0, glm::normalize(glm::dvec3(1, -2, 0.5))));
    explicit Flight(double noise_m) {
        Pcg32 rng(9);
        for (int i = 0; i < 30; ++i) {
            centres.emplace_back(i * 0.7, 3 * std::sin(i), 0.5 * std::cos(2 * i));
            const glm::dvec3 noise(rng.normal(), rng.normal(), rng.normal());
            positions.push_back(away(2.5 * (rotation * centres.back()) + noise_m * noise));
        }
    }
};

TEST(Gps, scale_north_and_place_come_from_positions) {
    Flight flight(0.05);
    flight.positions[3] = away({5000, 0, 0});  // two wrong ones
    flight.positions[17] = away({0, 0, 900});
    const auto found = place_by_positions(flight.centres, flight.positions);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->metres_per_unit, 2.5, 0.03);
    EXPECT_EQ(found->used, 28U);
    EXPECT_LT(found->off, 0.2);
    for (glm::length_t c = 0; c < 3; ++c)
        EXPECT_NEAR(glm::distance(found->place.rotation[c], flight.rotation[c]), 0, 0.02);
    // The world's origin is where it was.
    const GeoPosition anchor{found->place.latitude, found->place.longitude, found->place.altitude};
    EXPECT_NEAR(glm::distance(found->place.offset, east_north_up(kPlace, anchor)), 0, 0.2);
}

TEST(Gps, what_does_not_determine_a_place_says_nothing) {
    Flight flight(0);
    for (std::size_t i = 0; i < flight.centres.size(); ++i) {
        flight.centres[i] = {double(i), 0, 0};
        flight.positions[i] = away({2.5 * double(i), 0, 0});
    }
    EXPECT_FALSE(place_by_positions(flight.centres, flight.positions)) << "a line";
    EXPECT_FALSE(place_by_positions(std::span(flight.centres).first(3),
                                    std::span(flight.positions).first(3)));
    EXPECT_THROW(place_by_positions(flight.centres, {}), Error);
}

TEST(Gps, a_data_set_takes_scale_and_place_from_its_photos) {
    const auto folder = test_folder();
    const Flight flight(0.02);
    enum Kind { kExif, kDrone, kBoth };
    const auto write = [&](double noise, Kind kind = kExif) {
        std::string images;
        Pcg32 rng(4);
        for (std::size_t i = 0; i < 12; ++i) {
            const std::string name = fmt::format("{:02d}.jpg", i);
            const glm::dvec3 off(rng.normal(), rng.normal(), rng.normal());
            const GeoPosition place =
                away(2.5 * (flight.rotation * flight.centres[i]) + noise * off);
            std::string photo =
                kind == kDrone ? photo_by_drone(place, i % 2 == 0) : photo_with(place, 32, 32);
            if (kind == kBoth)
                photo.insert(2, drone_xmp(i == 4 ? away({100, 0, 0}) : place, false));
            write_file_atomic(folder / "images" / name, photo);
            const glm::dvec3 t = -flight.centres[i];
            images += fmt::format("{} 1 0 0 0 {} {} {} 1 {}\n\n", i + 1, t.x, t.y, t.z, name);
        }
        write_file_atomic(folder / "sparse/0/cameras.txt",
                          std::string("1 PINHOLE 32 32 30 30 16 16\n"));
        write_file_atomic(folder / "sparse/0/images.txt", images);
    };
    write(0.02);
    const Dataset dataset = load_dataset(folder);
    EXPECT_NEAR(dataset.metres_per_unit, 2.5, 0.05);
    EXPECT_TRUE(dataset.place.known());
    EXPECT_NE(dataset.notes.back().find("By the GPS of 12 photos"), std::string::npos);
    write(0.02, kDrone);
    const Dataset drone = load_dataset(folder);
    EXPECT_NEAR(drone.metres_per_unit, 2.5, 0.05);
    EXPECT_NE(drone.notes.back().find("By the GPS of 12 photos"), std::string::npos);
    write(0.02, kBoth);
    const Dataset both = load_dataset(folder);
    EXPECT_EQ(both.metres_per_unit, dataset.metres_per_unit) << "the EXIF counts";
    EXPECT_TRUE(std::ranges::any_of(both.notes, [](const std::string& note) {
        return note.find("in 1 photos the positions in EXIF and in the drone's XMP") !=
               std::string::npos;
    }));
    write(30);
    const Dataset coarse = load_dataset(folder);
    EXPECT_EQ(coarse.metres_per_unit, 0);
    EXPECT_FALSE(coarse.place.known());
}

TEST(EarthPlace, follows_transforms_and_is_kept_in_a_ply) {
    SplatModel model;
    model.position = {1, 2, 3};
    model.log_scale = {-1, -1, -1};
    model.rotation = {1, 0, 0, 0};
    model.opacity_logit = {0};
    model.sh_dc = {0, 0, 0};
    model.metres_per_unit = 2.5;
    model.place = {47, 8, 400, Flight(0).rotation, {10, 20, 30}};
    const auto where = [](const SplatModel& m) {
        return m.metres_per_unit * (m.place.rotation * position_of(m, 0)) + m.place.offset;
    };
    const glm::dvec3 before = where(model);
    const glm::dmat3 turn =
        glm::mat3_cast(glm::angleAxis(0.7, glm::normalize(glm::dvec3(3, 1, 2))));
    transform_splats({.scale = 4, .turn = turn, .translation = {5, -6, 7}}, model);
    EXPECT_NEAR(glm::distance(where(model), before), 0, 1e-4);
    const auto file = test_folder() / "a.ply";
    write_ply(file, model);
    const SplatModel read = read_ply(file);
    EXPECT_NEAR(glm::distance(where(read), before), 0, 1e-4);
    EXPECT_EQ(read.place.latitude, 47);
    for (const char* wrong : {"", "1 2 3", "95 0 0 1 0 0 0 0 0 0", "1 2 3 2 0 0 0 0 0 0",
                              "1 2 3 1 0 0 0 0 0 0 9", "1 2 nan 1 0 0 0 0 0 0"})
        EXPECT_FALSE(place_from_text(wrong)) << wrong;
}

}  // namespace
}  // namespace darb
