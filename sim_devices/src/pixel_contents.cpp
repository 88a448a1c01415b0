#include "pixel_contents.h"

#include <algorithm>

#include "gonio/parallel/parallel.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kContentRows = 16;
constexpr std::uint16_t kShines = 0x8000;

std::uint16_t code_of(const TargetView::Kind& kind) {
  return static_cast<std::uint16_t>(kind.surface | (kind.shines ? kShines : 0));
}

void note_changes(const std::uint16_t* kinds, std::size_t away, std::size_t count,
                  std::uint8_t* changes) {
  for (std::size_t i = 0; i < count; ++i) {
    changes[i] |= static_cast<std::uint8_t>(kinds[i] != kinds[i + away]);
  }
}

}  // namespace

/// One look: what the passes over the rows share.
class PixelContents::Looker {
 public:
  Looker(PixelContents& contents, const TargetView& view, const Lens& lens)
      : to_(contents),
        view_(view),
        lens_(lens),
        surfaces_(view.scene().surfaces()),
        parts_(contents.sampling_.parts) {}

  /// Kind and light of every pixel's middle.
  void look_at_middles(std::size_t row) {
    const std::size_t width = to_.width_;
    const std::size_t first = row * width;
    std::vector<double> x_mm(width);
    std::vector<double> y_mm(width);
    view_.places_along({lens_.all_x().data() + first, lens_.all_y().data() + first, width},
                       {x_mm.data(), y_mm.data(), to_.irradiances_.data() + first});
    for (std::size_t column = 0; column < width; ++column) {
      to_.kinds_[first + column] = code_of(
          view_.kind_at({x_mm[column], y_mm[column]}, view_.direction(lens_.ray(first + column))));
    }
  }

  /// Decides which pixels of some rows are listed, and lists them.
  void list(std::size_t begin, std::size_t end) {
    const PartKinds kinds = kinds_of_parts(begin, end);
    for (std::size_t row = begin; row < end; ++row) list(row, kinds);
  }

 private:
  bool plain(std::uint16_t code) const {
    return (code & kShines) == 0 && surfaces_[code].per_sr.has_value();
  }

  /// Kinds of the parts of pixels, of some rows and one more on either side.
  struct PartKinds {
    std::size_t first_row = 0;                         ///< of pixels
    std::size_t width = 0;                             ///< parts
    std::vector<std::vector<std::uint8_t>> near_edge;  ///< by row
    std::vector<std::uint16_t> kinds;  ///< row by row of parts; none for whole pixels

    std::uint16_t of_first_part(std::size_t row, std::size_t column) const {
      return kinds[(row - first_row) * 2 * width + 2 * column];
    }
  };

  PartKinds kinds_of_parts(std::size_t begin, std::size_t end) const {
    const std::size_t height = to_.rows_.size();
    PartKinds found{begin - std::min<std::size_t>(begin, 1), to_.width_ * parts_, {}, {}};
    const std::size_t last = std::min(end + 1, height);
    for (std::size_t row = found.first_row; row < last; ++row) {
      found.near_edge.push_back(edges_near(row));
    }
    if (parts_ == 1) return found;
    found.kinds.resize((last - found.first_row) * parts_ * found.width);
    for (std::size_t row = found.first_row; row < last; ++row) {
      const std::vector<std::uint8_t>& near = found.near_edge[row - found.first_row];
      const std::uint16_t* const middles = to_.kinds_.data() + row * to_.width_;
      std::uint16_t* const upper = found.kinds.data() + (row - found.first_row) * 2 * found.width;
      for (std::size_t column = 0; column < to_.width_; ++column) {
        std::uint16_t* const two = upper + 2 * column;
        if (near[column] == 0) {
          two[0] = two[1] = two[found.width] = two[found.width + 1] = middles[column];
          continue;
        }
        const Neighbourhood here(view_, lens_, to_, row, column);
        for (int part = 0; part < 4; ++part) {
          two[part / 2 * found.width + part % 2] =
              code_along(here.direction(in_part(part / 2, part % 2, 0.0, 0.0)));
        }
      }
    }
    return found;
  }

  void list(std::size_t row, const PartKinds& kinds) {
    const std::size_t width = to_.width_;
    Row& listed = to_.rows_[row];
    listed.columns.clear();
    listed.radiances.clear();
    const std::vector<std::uint8_t>& near_edge = kinds.near_edge[row - kinds.first_row];
    for (std::size_t column = 0; column < width; ++column) {
      const std::size_t pixel = row * width + column;
      std::uint16_t& surface = to_.surfaces_[pixel];
      surface = to_.kinds_[pixel];
      const bool mixed = near_edge[column] != 0;
      if (!mixed && plain(surface)) continue;
      if (!mixed) {
        see(row, column, listed);
      } else if (!mix(row, column, kinds, listed)) {
        continue;
      }
      surface = kListed;
      listed.columns.push_back(static_cast<std::uint32_t>(column));
    }
  }

  /// Which parts of a pixel (a bit each) have a neighbour of another kind.
  unsigned edges_in(std::size_t row, std::size_t column, const PartKinds& kinds) const {
    if (parts_ == 1) return 1;  // what is near an edge is taken for one
    const std::size_t rows = kinds.kinds.size() / kinds.width;
    unsigned edges = 0;
    for (std::size_t part = 0; part < 4; ++part) {
      const std::size_t r = (row - kinds.first_row) * 2 + part / 2;
      const std::size_t c = column * 2 + part % 2;
      const std::uint16_t* const here = kinds.kinds.data() + r * kinds.width + c;
      const std::uint16_t* const above = r > 0 ? here - kinds.width : here;
      const std::uint16_t* const below = r + 1 < rows ? here + kinds.width : here;
      const std::size_t left = c > 0 ? 1 : 0;
      const std::size_t right = c + 1 < kinds.width ? 1 : 0;
      bool edge = false;
      for (const std::uint16_t* line : {above, here, below}) {
        edge = edge || *(line - left) != *here || *line != *here || *(line + right) != *here;
      }
      edges |= (edge ? 1U : 0U) << part;
    }
    return edges;
  }

  /// 1 for pixels of a row within reach of which something else begins: a part of such a pixel may
  /// lie there, if only with a corner that passes all middles by.
  std::vector<std::uint8_t> edges_near(std::size_t row) const {
    const std::size_t width = to_.width_;
    std::vector<std::uint8_t> near(width, 0);
    if (to_.sampling_.rays == 1) return near;
    const std::size_t reach = parts_;
    const std::size_t last = std::min(row + reach, to_.rows_.size() - 1);
    std::vector<std::uint8_t> changes(width + 2 * reach, 0);  // to the right or below, `reach` on
    for (std::size_t r = row - std::min(reach, row); r <= last; ++r) {
      note_changes(to_.kinds_.data() + r * width, 1, width - 1, changes.data() + reach);
      if (r == last) break;
      note_changes(to_.kinds_.data() + r * width, width, width, changes.data() + reach);
    }
    for (std::size_t shift = 0; shift <= 2 * reach; ++shift) {
      for (std::size_t column = 0; column < width; ++column)
        near[column] |= changes[column + shift];
    }
    return near;
  }

  /// Places in and about one pixel, in pixels to the right of and down from its middle, from where
  /// the lens' distortion and the light go on in a straight line.
  class Neighbourhood {
   public:
    Neighbourhood(const TargetView& view, const Lens& lens, const PixelContents& contents,
                  std::size_t row, std::size_t column)
        : middle_(view.direction(lens.ray_in(row, column, 0.0, 0.0))),
          right_(view.direction(lens.ray_in(row, column, 1.0, 0.0)) - middle_),
          down_(view.direction(lens.ray_in(row, column, 0.0, 1.0)) - middle_),
          light_(contents.light(row, column)) {}

    Eigen::Vector3d direction(const Eigen::Vector2d& at) const {
      return middle_ + at.x() * right_ + at.y() * down_;
    }
    double light(const Eigen::Vector2d& at) const {
      // Where the light is only beginning, a straight line leads below nothing.
      return std::max(0.0, light_.middle + at.x() * light_.to_right + at.y() * light_.down);
    }

   private:
    Eigen::Vector3d middle_;
    Eigen::Vector3d right_;
    Eigen::Vector3d down_;
    PixelContents::Light light_;
  };

  /// The place at (x, y) of a part, in parts from its middle.
  Eigen::Vector2d in_part(int down, int right, double x, double y) const {
    const double part = 1.0 / static_cast<double>(parts_);
    return {(right + 0.5 + x) * part - 0.5, (down + 0.5 + y) * part - 0.5};
  }

  std::uint16_t code_along(const Eigen::Vector3d& direction) const {
    return code_of(view_.kind_at(view_.place_along(direction), direction));
  }

  static void add(const brdf::Rgb& radiance, double weight, std::array<double, 3>& sum) {
    for (int band = 0; band < 3; ++band) sum[band] += weight * radiance[band];
  }
  static void keep(const std::array<double, 3>& sum, Row& listed) {
    listed.radiances.push_back(
        {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])});
  }

  /// A pixel of one kind that is not plain.
  void see(std::size_t row, std::size_t column, Row& listed) const {
    const int n = static_cast<int>(parts_);
    const Neighbourhood here(view_, lens_, to_, row, column);
    for (int part = 0; part < n * n; ++part) {
      std::array<double, 3> sum{};
      const Eigen::Vector3d along = here.direction(in_part(part / n, part % n, 0.0, 0.0));
      add(view_.radiance_at(view_.place_along(along), along), 1.0, sum);
      keep(sum, listed);
    }
  }

  /// A pixel with an edge in it or near; false if it is plain after all.
  bool mix(std::size_t row, std::size_t column, const PartKinds& kinds, Row& listed) const {
    const unsigned edges = edges_in(row, column, kinds);
    const std::uint16_t middle = to_.kinds_[row * to_.width_ + column];
    if (edges == 0 && plain(middle) && middle == kinds.of_first_part(row, column)) return false;
    const int n = static_cast<int>(parts_);
    const Neighbourhood here(view_, lens_, to_, row, column);
    for (int part = 0; part < n * n; ++part) {
      const bool edge = (edges >> part & 1U) != 0;
      std::array<double, 3> sum{};
      const int rays = edge ? to_.sampling_.rays : 1;
      for (int i = 0; i < rays; ++i) {
        const double x = (i + 0.5) / rays - 0.5;
        const double y = (i * to_.sampling_.step % rays + 0.5) / rays - 0.5;
        const Eigen::Vector2d at = in_part(part / n, part % n, x, y);
        const Eigen::Vector3d along = here.direction(at);
        const TargetView::Place place = view_.place_along(along);
        const std::uint16_t code = code_of(view_.kind_at(place, along));
        if (plain(code)) {
          add(*surfaces_[code].per_sr, here.light(at) / rays, sum);
        } else {
          add(view_.radiance_at(place, along), 1.0 / rays, sum);
        }
      }
      keep(sum, listed);
    }
    return true;
  }

  PixelContents& to_;
  const TargetView& view_;
  const Lens& lens_;
  const std::vector<Surface>& surfaces_;
  std::size_t parts_;
};

void PixelContents::look(const TargetView& view, const Lens& lens, const Sampling& sampling) {
  sampling_ = sampling;
  width_ = lens.width();
  const std::size_t height = lens.height();
  rows_.resize(height);
  surfaces_.resize(width_ * height);
  irradiances_.resize(width_ * height);
  kinds_.resize(width_ * height);
  per_sr_.clear();
  for (const Surface& surface : view.scene().surfaces()) {
    const brdf::Rgb per_sr = surface.per_sr.value_or(brdf::Rgb::Zero());
    per_sr_.push_back({static_cast<float>(per_sr[0]), static_cast<float>(per_sr[1]),
                       static_cast<float>(per_sr[2])});
  }
  Looker looker(*this, view, lens);
  parallel::for_each_block(0, height, kContentRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) looker.look_at_middles(row);
  });
  parallel::for_each_block(0, height, kContentRows,
                           [&](std::size_t begin, std::size_t end) { looker.list(begin, end); });
}

}  // namespace gonio::sim
