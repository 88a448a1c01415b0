#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "materials_input.h"

namespace gonio::cli {

/// --siblings
void add_siblings_option(const Command& command, std::string& path);

/// Groups of siblings (basis::sibling_groups()) from a CSV file "material,group"; materials it does
/// not list stand alone. A file serves subsets too: names that are not among the materials bring a
/// warning. Throws UsageError when it names none of them or one in two groups, DataFormatError.
/// `trained`  Materials of a basis that is appended to, which the file may name as well; null:
/// none.
///            One that has another group already is refused.
void read_siblings(const Console& console, const std::filesystem::path& path, TrainingInput& input,
                   std::vector<basis::MaterialId>* trained = nullptr);

}  // namespace gonio::cli
