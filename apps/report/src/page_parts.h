#pragma once

#include "gonio/page/html.h"
#include "gonio/page/style.h"
#include "gonio/page/svg.h"

namespace gonio::report {

using page::Axis;
using page::decade_label;
using page::duration;
using page::embedded_picture;
using page::escaped;
using page::grouped;
using page::kChannelClasses;
using page::number;
using page::Point;
using page::style_sheet;
using page::Svg;

}  // namespace gonio::report
