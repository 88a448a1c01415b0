#include "blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "gonio/parallel/avx2.h"
#include "gonio/parallel/parallel.h"

namespace gonio::sim {
namespace {

constexpr double kReachSigmas = 4.0;
constexpr std::size_t kBlurRows = 64;
constexpr std::size_t kLanes = 16;       // values that are summed side by side
constexpr std::size_t kMostChunks = 64;  // of a row: bits of a word

/// Weights of parts for the mean over a pixel of what is blurred part by part: those of the parts
/// from `reach` before the pixel's first to `reach` after its last.
struct Taps {
  int reach;  ///< parts
  std::vector<float> weights;
};

Taps taps_of(double sigma_px, std::size_t parts) {
  const double sigma = sigma_px * static_cast<double>(parts);
  const int reach = static_cast<int>(std::ceil(kReachSigmas * sigma));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int at = -reach; at <= reach; ++at) {
    kernel.push_back(sigma > 0.0 ? std::exp(-0.5 * at * at / (sigma * sigma)) : 1.0);
    sum += kernel.back();
  }
  Taps taps{reach, std::vector<float>(kernel.size() + parts - 1)};
  for (std::size_t i = 0; i < taps.weights.size(); ++i) {
    double weight = 0.0;
    for (std::size_t part = 0; part < parts && part <= i; ++part) {
      if (i - part < kernel.size()) weight += kernel[i - part];
    }
    taps.weights[i] = static_cast<float>(weight / (sum * static_cast<double>(parts)));
  }
  return taps;
}

/// out[i] = sum of weights[k] * rows[k][i]; `count` is a multiple of kLanes.
GONIO_INLINE void weigh_loop(const float* const* rows, const float* weights, std::size_t taps,
                             std::size_t count, float* out) {
  for (std::size_t at = 0; at < count; at += kLanes) {
    float sum[kLanes] = {};
    for (std::size_t tap = 0; tap < taps; ++tap) {
      const float* const row = rows[tap] + at;
      for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += weights[tap] * row[lane];
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) out[at + lane] = sum[lane];
  }
}

void weigh_plainly(const float* const* rows, const float* weights, std::size_t taps,
                   std::size_t count, float* out) {
  weigh_loop(rows, weights, taps, count, out);
}
#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void weigh_avx2(const float* const* rows, const float* weights, std::size_t taps,
                                  std::size_t count, float* out) {
  weigh_loop(rows, weights, taps, count, out);
}
#endif

void weigh(const float* const* rows, const std::vector<float>& weights, std::size_t count,
           float* out) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return weigh_avx2(rows, weights.data(), weights.size(), count, out);
#endif
  weigh_plainly(rows, weights.data(), weights.size(), count, out);
}

using Chunks = std::uint64_t;  ///< a bit for each of a row

/// Cuts rows into chunks, so that most of a picture need not be blurred.
class ChunkedRows {
 public:
  ChunkedRows(std::size_t width, std::size_t reach_px)
      : width_(width),
        reach_px_(reach_px),
        chunk_(kLanes * ((width + kLanes * kMostChunks - 1) / (kLanes * kMostChunks))) {}

  std::size_t chunk() const { return chunk_; }
  std::size_t count() const { return (width_ + chunk_ - 1) / chunk_; }

  /// Chunks with a pixel within reach of this one.
  Chunks around(std::size_t column) const {
    const std::size_t first = (column - std::min(column, reach_px_)) / chunk_;
    const std::size_t last = std::min(column + reach_px_, width_ - 1) / chunk_;
    Chunks chunks = 0;
    for (std::size_t c = first; c <= last; ++c) chunks |= Chunks{1} << c;
    return chunks;
  }

  /// Runs of neighbouring chunks as (first column, number of columns), which may end beyond the
  /// width.
  template <typename Body>
  void for_each_run(Chunks chunks, Body&& body) const {
    for (std::size_t c = 0; c < count(); ++c) {
      if ((chunks >> c & 1U) == 0) continue;
      const std::size_t first = c;
      while (c + 1 < count() && (chunks >> (c + 1) & 1U) != 0) ++c;
      body(first * chunk_, (c + 1 - first) * chunk_);
    }
  }

 private:
  std::size_t width_;
  std::size_t reach_px_;
  std::size_t chunk_;
};

/// Chunks of a row within reach of which something else than one plain surface lies in that row or
/// begins below it.
Chunks unrest_of(const PixelContents& contents, std::size_t row, const ChunkedRows& chunked) {
  const std::uint16_t* const here = contents.surfaces(row);
  const std::uint16_t* const below =
      row + 1 < contents.height() ? contents.surfaces(row + 1) : here;
  const std::size_t width = contents.width();
  // Beyond the picture its edge goes on, but not the slope of its light.
  Chunks chunks = chunked.around(0) | chunked.around(width - 1);
  if (row == 0 || row + 1 == contents.height()) chunks = ~Chunks{0};
  for (std::size_t c = 0; c < chunked.count(); ++c) {
    const std::size_t first = c * chunked.chunk();
    const std::size_t end = std::min(first + chunked.chunk(), width);
    bool calm = true;
    for (std::size_t i = first; i < end; ++i) {
      calm &= here[i] != PixelContents::kListed && here[i] == below[i] &&
              here[i] == here[std::min(i + 1, width - 1)];
    }
    if (calm) continue;
    for (std::size_t i = first; i < end; ++i) {
      if (here[i] == PixelContents::kListed || here[i] != below[i] ||
          here[i] != here[std::min(i + 1, width - 1)]) {
        chunks |= chunked.around(i) | chunked.around(std::min(i + 1, width - 1));
      }
    }
  }
  return chunks;
}

/// One thread's way down some rows: rows of parts, blurred along themselves, are kept for as long
/// as rows of pixels need them.
class Descent {
 public:
  /// `wanted`  Of each row the chunks that rows within reach of it need when they are blurred.
  Descent(const PixelContents& contents, std::size_t band, const Taps& taps,
          const ChunkedRows& chunked, const std::vector<Chunks>& wanted)
      : contents_(contents),
        band_(band),
        taps_(taps),
        parts_(contents.parts()),
        chunked_(chunked),
        wanted_(wanted),
        padded_(chunked.count() * chunked.chunk()),
        margin_(static_cast<std::size_t>(taps.reach) / parts_ + 1),
        kept_(taps.weights.size() + parts_ - 1, std::vector<float>(padded_)),
        kept_parts_(kept_.size(), -1) {
    for (std::size_t part = 0; part < parts_; ++part) {
      parts_of_row_[part].assign(padded_ + 2 * margin_ + kLanes, 0.0F);
    }
  }

  /// `row`, blurred, where `chunks` say.
  void blur_row(std::size_t row, Chunks chunks, float* to) {
    const int last_part = static_cast<int>(contents_.height() * parts_) - 1;
    std::vector<const float*> rows;
    for (std::size_t tap = 0; tap < taps_.weights.size(); ++tap) {
      const int part = static_cast<int>(row * parts_ + tap) - taps_.reach;
      rows.push_back(along(std::clamp(part, 0, last_part)).data());
    }
    std::vector<const float*> shifted(rows.size());
    chunked_.for_each_run(chunks, [&](std::size_t first, std::size_t count) {
      for (std::size_t tap = 0; tap < rows.size(); ++tap) shifted[tap] = rows[tap] + first;
      line_.resize(padded_);
      weigh(shifted.data(), taps_.weights, count, line_.data());
      std::copy_n(line_.data(), std::min(count, contents_.width() - first), to + first);
    });
  }

 private:
  /// A row of parts, blurred along itself where that is wanted.
  const std::vector<float>& along(int part_row) {
    const auto place = static_cast<std::size_t>(part_row) % kept_.size();
    if (kept_parts_[place] == part_row) return kept_[place];
    kept_parts_[place] = part_row;
    const std::size_t row = static_cast<std::size_t>(part_row) / parts_;
    compose(row, static_cast<std::size_t>(part_row) % parts_);
    std::vector<const float*> shifted(taps_.weights.size());
    chunked_.for_each_run(wanted_[row], [&](std::size_t first, std::size_t count) {
      for (std::size_t tap = 0; tap < shifted.size(); ++tap) {
        const int part = static_cast<int>(tap) - taps_.reach + static_cast<int>(margin_ * parts_);
        const auto from = static_cast<std::size_t>(part);
        shifted[tap] = parts_of_row_[from % parts_].data() + from / parts_ + first;
      }
      weigh(shifted.data(), taps_.weights, count, kept_[place].data() + first);
    });
    return kept_[place];
  }

  /// The radiances of a row of parts, its ends repeated.
  void compose(std::size_t row, std::size_t down) {
    const std::size_t width = contents_.width();
    const std::uint16_t* const surfaces = contents_.surfaces(row);
    const float* const light = contents_.irradiances(row);
    const auto& per_sr = contents_.per_sr();
    // Light changes within a pixel by so little that its parts are reached in a straight line.
    const float below = parts_ == 1 ? 0.0F : 0.5F * static_cast<float>(down) - 0.25F;
    const float beside = parts_ == 1 ? 0.0F : 0.25F;
    const std::size_t next_row = row + 1 < contents_.height() ? row + 1 : row;
    const std::size_t this_row = next_row > 0 ? next_row - 1 : 0;
    const float* const upper = contents_.irradiances(this_row);
    const float* const lower = contents_.irradiances(next_row);
    float* const left = parts_of_row_[0].data() + margin_;
    float* const right = parts_of_row_[parts_ - 1].data() + margin_;
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t surface = surfaces[i] == PixelContents::kListed ? 0 : surfaces[i];
      const std::size_t pair = i + 1 < width || i == 0 ? i : i - 1;
      const float middle = light[i] + below * (lower[i] - upper[i]);
      const float aside = beside * (light[std::min(pair + 1, width - 1)] - light[pair]);
      left[i] = per_sr[surface][band_] * std::max(0.0F, middle - aside);
      right[i] = per_sr[surface][band_] * std::max(0.0F, middle + aside);
    }
    const PixelContents::Row& listed = contents_.listed(row);
    for (std::size_t k = 0; k < listed.columns.size(); ++k) {
      for (std::size_t part = 0; part < parts_; ++part) {
        parts_of_row_[part][margin_ + listed.columns[k]] =
            listed.radiances[(k * parts_ + down) * parts_ + part][band_];
      }
    }
    const float left_end = parts_of_row_[0][margin_];
    const float right_end = parts_of_row_[parts_ - 1][margin_ + width - 1];
    for (std::size_t part = 0; part < parts_; ++part) {
      std::vector<float>& line = parts_of_row_[part];
      std::fill(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(margin_), left_end);
      std::fill(line.begin() + static_cast<std::ptrdiff_t>(margin_ + width), line.end(), right_end);
    }
  }

  const PixelContents& contents_;
  std::size_t band_;
  const Taps& taps_;
  std::size_t parts_;
  const ChunkedRows& chunked_;
  const std::vector<Chunks>& wanted_;
  std::size_t padded_;  ///< columns, to whole chunks
  std::size_t margin_;  ///< columns before the first
  std::array<std::vector<float>, 2> parts_of_row_;
  std::vector<std::vector<float>> kept_;  ///< by row of parts, in turn
  std::vector<int> kept_parts_;
  std::vector<float> line_;
};

void copy_plain(const PixelContents& contents, std::size_t band, std::size_t row, float* to) {
  const std::uint16_t* const surfaces = contents.surfaces(row);
  const float* const light = contents.irradiances(row);
  const auto& per_sr = contents.per_sr();
  for (std::size_t i = 0; i < contents.width(); ++i) {
    const std::size_t surface = surfaces[i] == PixelContents::kListed ? 0 : surfaces[i];
    to[i] = per_sr[surface][band] * light[i];
  }
}

/// wide[i] = all of narrow[i - reach] .. narrow[i + reach].
std::vector<Chunks> spread_over_rows(const std::vector<Chunks>& narrow, std::size_t reach) {
  std::vector<Chunks> wide(narrow.size(), 0);
  for (std::size_t row = 0; row < narrow.size(); ++row) {
    if (narrow[row] == 0) continue;
    const std::size_t last = std::min(row + reach, narrow.size() - 1);
    for (std::size_t r = row - std::min(row, reach); r <= last; ++r) wide[r] |= narrow[row];
  }
  return wide;
}

}  // namespace

void blur(const PixelContents& contents, std::size_t band, double sigma_px,
          std::vector<float>& plane) {
  const std::size_t width = contents.width();
  const std::size_t height = contents.height();
  plane.resize(width * height);
  const Taps taps = taps_of(sigma_px, contents.parts());
  const std::size_t reach_px = static_cast<std::size_t>(taps.reach) / contents.parts() + 1;
  const ChunkedRows chunked(width, reach_px);
  std::vector<Chunks> unrest(height);
  parallel::for_each_block(0, height, kBlurRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) unrest[row] = unrest_of(contents, row, chunked);
  });
  // What begins below a row is of the next as well: one more.
  const std::vector<Chunks> blurred = spread_over_rows(unrest, reach_px + 1);
  const std::vector<Chunks> wanted = spread_over_rows(blurred, reach_px);
  parallel::for_each_block(0, height, kBlurRows, [&](std::size_t begin, std::size_t end) {
    Descent descent(contents, band, taps, chunked, wanted);
    for (std::size_t row = begin; row < end; ++row) {
      float* const to = plane.data() + row * width;
      copy_plain(contents, band, row, to);
      if (blurred[row] != 0) descent.blur_row(row, blurred[row], to);
    }
  });
}

}  // namespace gonio::sim
