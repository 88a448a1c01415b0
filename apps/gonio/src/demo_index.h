#pragma once

#include <string>
#include <vector>

namespace gonio::cli {

/// One material of the demo and the PSNR of its pictures, dB.
struct DemoRow {
  std::string material;
  double ours_db = 0.0;
  double points_db = 0.0;
  double published_db = 0.0;
};

/// The page that leads to the reports of all, MATERIAL/report.html beside it.
std::string demo_index_page(const std::vector<DemoRow>& rows);

}  // namespace gonio::cli
