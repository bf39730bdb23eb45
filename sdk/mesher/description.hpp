#pragma once

#include "shape.hpp"

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace calot::mesher {

/// One line: "file:line: field: what is wrong: remedy".
class DescriptionError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A named part of the surface: triangles whose centre lies inside a shape.
struct Region {
    std::string name;
    ShapePtr inside;  ///< null for the last region, which is everything else
    double edge;      ///< largest edge wanted, mm
    double deviation; ///< largest distance of a triangle from the surface, mm
};

struct Organ {
    std::string name, title;
    std::size_t triangles; ///< budget
    double edge;           ///< mm; the grid that looks for the surface is this fine
    ShapePtr solid;
    std::vector<Region> regions;
    std::map<std::string, ShapePtr> shapes; ///< all of them, by id
    std::string sha256;                     ///< of the description's bytes
    /// The other descriptions that its shapes were taken from: file name and SHA-256, sorted by name.
    std::map<std::string, std::string> uses;
};

/// The keys that a description's `source` may cite: the first column of a tab-separated file.
std::vector<std::string> read_fact_keys(const std::filesystem::path& file);

/// Reads and checks an organ's description; README.md beside this file describes the language. Throws
/// DescriptionError, or MeshError when a file cannot be read.
Organ read_organ(const std::filesystem::path& file, const std::vector<std::string>& fact_keys);

} // namespace calot::mesher
