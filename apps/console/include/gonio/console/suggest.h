#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gonio::cli {

/// The word of a list that a mistyped one may have meant; empty when none is near (more than a
/// third of its letters wrong).
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// ", did you mean \"X\"?", or nothing.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace gonio::cli
