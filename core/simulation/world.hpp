// The scene as it is simulated: organs in one static scene of triangles, landmarks, guide, start poses,
// endoscope.
#pragma once

#include "geometry/triangle_scene.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/scene.hpp"

#include <calot/abi/common.h>
#include <calot/meshio/mesh.hpp>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace calot::simulation {

/// An organ of an anatomy: its mesh, how it rubs, how it looks.
struct Organ {
    std::string id, title;
    std::filesystem::path mesh_file;
    std::string mesh_hash;                                // SHA-256
    double friction = 0;                                  // Coulomb, against a bare sheath
    std::map<std::string, double> region_friction;        // in its place, by region
    std::string appearance;                               // for all of it, or
    std::map<std::string, std::string> region_appearance; // by region
    meshio::TriangleMesh mesh;
};

/// A named place: a pose (+z along its normal or direction), a polyline, or both.
struct Landmark {
    std::string id;
    std::optional<calot_pose> pose;
    double radius = 0;                  // m, of a ring; 0: none
    std::vector<geometry::Vec3> points; // m
};

struct Anatomy {
    std::string name, title;
    std::filesystem::path folder;
    std::vector<Organ> organs;
    std::vector<Landmark> landmarks;
    const Landmark* find(std::string_view id) const;
};

/// Of each region of the organ's mesh, in the order of its names; one number for a mesh without regions.
std::vector<double> friction_by_region(const Organ& organ);

using MeshFiles = std::map<std::string, std::filesystem::path>;

struct WorldOptions {
    std::filesystem::path assets{};    // folder with anatomy/ and endoscopes/
    std::string anatomy{};             // overrides the scene's
    MeshFiles meshes{};                // an organ's mesh by its id, in place of the anatomy's
    std::filesystem::path endoscope{}; // a datasheet's file; overrides the scene's
    std::optional<double> friction{};  // Coulomb, of every organ in place of its own
};

struct World {
    SceneDescription scene;
    std::string scene_hash; // SHA-256 of the scene's text
    Anatomy anatomy;        // organs that the scene names, in its order
    EndoscopeDatasheet endoscope;
    geometry::TriangleScene surfaces; // organ index as in anatomy.organs
};

/// Reads anatomy, meshes and datasheet. Throws host::UserError, one line: "FILE: FIELD: what; remedy".
std::shared_ptr<const World> load_world(const SceneDescription& scene, const WorldOptions& options);

/// Reads assets/anatomy/<name>/anatomy.toml; `organs` empty: all of them. `meshes` stand in for the files
/// that it names. Same errors.
Anatomy load_anatomy(const std::filesystem::path& file, const std::vector<std::string>& organs = {},
                     const MeshFiles& meshes = {});

} // namespace calot::simulation
