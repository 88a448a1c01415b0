#pragma once

#include <cstddef>
#include <mutex>

/// Names and limits of the basis file, shared by its writer and reader (docs/formats.md).
namespace gonio::basis::schema {

constexpr char kFileKind[] = "gonio basis";
constexpr int kVersion = 2;

constexpr char kAttributeKind[] = "file_kind";
constexpr char kAttributeVersion[] = "format_version";
constexpr char kAttributeConvention[] = "lattice_convention";
constexpr char kAttributeScale[] = "radiometric_scale";
constexpr char kAttributeRows[] = "training_rows";
constexpr char kAttributeEpsilon[] = "mapping_epsilon";
constexpr char kAttributeFloor[] = "mapping_cosine_floor";

constexpr char kMean[] = "mean";
constexpr char kComponents[] = "components";
constexpr char kSingularValues[] = "singular_values";
constexpr char kLeftVectors[] = "left_vectors";
constexpr char kCells[] = "cells";
constexpr char kMaterialNames[] = "material_names";
constexpr char kMaterialFamilies[] = "material_families";
constexpr char kMaterialHashes[] = "material_sha256";
constexpr char kMaterialSources[] = "material_sources";             // absent: unknown
constexpr char kMaterialGroups[] = "material_groups";               // absent: no siblings
constexpr char kMaterialScaleFactors[] = "material_scale_factors";  // absent: 1 for all

/// Far above any collection of measured materials; bounds what a hostile file can ask for.
constexpr std::size_t kMostMaterials = 20000;
constexpr std::size_t kLongestText = 1024;

/// HDF5 may be built without thread safety.
std::mutex& library_mutex();

}  // namespace gonio::basis::schema
