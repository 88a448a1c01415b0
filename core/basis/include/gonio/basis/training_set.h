#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gonio/basis/log_mapping.h"
#include "gonio/brdf/brdf_table.h"

namespace gonio::basis {

/// Who a training material is.
struct MaterialId {
  std::string name;
  std::string family;  ///< empty when unknown
  std::string sha256;  ///< of the file, or of the tabulated values of a built-in one
  /// What its values were multiplied by to be in the set's radiometric scale; 1: they were.
  double scale_factor = 1.0;
  std::string source =
      {};  ///< database it comes from, such as merl, rgl, builtin; empty when unknown
  std::string group = {};  ///< of siblings (siblings.h); empty: it has none
};

/// A file to train on, in any format of brdf::read_material().
struct MaterialFile {
  std::filesystem::path path;
  std::string family;
  /// Brings its values to the set's scale when it has another; empty: another scale is refused.
  std::optional<double> scale_factor = std::nullopt;
  std::string source = {};  ///< empty: the name of the file's format
  std::string group = {};   ///< as MaterialId::group
};

/// Mapped training data: three rows (R, G, B) per material, one column per lattice cell above the
/// horizon (lattice::cells_above_horizon()).
///
/// Memory   12 bytes per material and cell: 1.2 GB for 90 materials.
/// Missing  Cells above the horizon that a file marks invalid take the channel's mean over the
///          materials that have them (black where none has); a material with more than a fifth
///          missing is refused.
/// State    An add that throws leaves the set as it was.
/// Threads  add() and its sisters by one thread; const members from many. Work is shared out with
///          gonio::parallel and the result does not depend on the number of threads.
class TrainingSet {
 public:
  explicit TrainingSet(brdf::RadiometricScale scale, LogMapping mapping = {});

  /// Throws std::invalid_argument for another scale or lattice convention (bin_centre), a name
  /// that is already there, a value that is not finite or too many missing cells.
  void add(MaterialId id, const brdf::BrdfTable& table);

  /// The same from a model whose numbers are in the set's scale, without a table in between. An
  /// empty id.sha256 becomes the hash of the mapped values.
  void add(MaterialId id, const brdf::BrdfModel& model);

  /// Reads and adds material files, several at a time (35 MB of memory each while it is read). The
  /// material's name is the file name without its extension, its sha256 that of the file.
  /// `on_progress`  Called on this thread with the number of files read so far; what it throws is
  ///                passed on.
  /// Throws DataFormatError naming the file, also for what add() refuses.
  void add_files(std::span<const MaterialFile> files,
                 const std::function<void(std::size_t)>& on_progress = {});

  std::size_t material_count() const { return materials_.size(); }
  const std::vector<MaterialId>& materials() const { return materials_; }
  brdf::RadiometricScale scale() const { return scale_; }
  const LogMapping& mapping() const { return mapping_; }
  const std::vector<std::uint32_t>& cells() const;

  /// Mapped values of one channel of a material, cells().size() long.
  std::span<const float> row(std::size_t material, int channel) const;

  /// Positions in cells() where the material has no value of its own, ascending.
  std::span<const std::uint32_t> missing(std::size_t material) const;

  /// Mapping weights of the cells, cells().size() long.
  std::span<const float> weights() const { return weights_; }

 private:
  /// Three planes of mapped values and where the material has none.
  struct Mapped {
    std::vector<float> rows;             ///< R, G, B planes, cells().size() each
    std::vector<std::uint32_t> missing;  ///< positions in cells(), ascending
  };

  Mapped map(const brdf::BrdfTable& table) const;
  Mapped map(const brdf::BrdfModel& model) const;
  void check_new_name(const std::string& name) const;
  void append(MaterialId id, Mapped mapped);
  void fill_missing();

  brdf::RadiometricScale scale_;
  LogMapping mapping_;
  std::vector<float> weights_;
  std::vector<MaterialId> materials_;
  std::vector<Mapped> mapped_;
};

/// Mapped values of any table at the cells of a set or basis, for metrics and projections.
///
/// Returns  p x 3, a column per channel; NaN where the table has no value.
Eigen::MatrixXf mapped_values(const LogMapping& mapping, const brdf::BrdfTable& table);

/// Gram matrix of all rows after subtracting the mean of all rows (3 materials x 3 materials,
/// row-major by material then channel). Any subset's centred Gram follows from it, so it is
/// computed once and every fold is cheap. Blocks in float32, sums in double, fixed order.
Eigen::MatrixXd centred_gram(const TrainingSet& set);

}  // namespace gonio::basis
