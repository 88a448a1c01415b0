#pragma once

#include <span>
#include <string_view>

namespace gonio::monitor {

/// A file of the pages, within the program.
struct PageFile {
  std::string_view path;
  std::string_view content_type;
  std::string_view text;
};

std::span<const PageFile> page_files();

/// What the live pages add to the style sheet of all pages.
extern const std::string_view kLiveStyle;

}  // namespace gonio::monitor
