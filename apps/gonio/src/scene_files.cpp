#include "scene_files.h"

#include <fmt/format.h>

#include "gonio/console/failures.h"
#include "gonio/page/escaped.h"

namespace gonio::cli {
namespace {

void require_plain(const std::string& name) {
  for (const char c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F || c == '"' || c == '\\') {
      throw UsageError(
          "--out: found a control character, quote or backslash in the name, which a "
          "scene file cannot hold");
    }
  }
}

}  // namespace

std::string mitsuba_scene(const std::string& bsdf_name) {
  require_plain(bsdf_name);
  return fmt::format(R"(<!-- mitsuba -m scalar_spectral THIS_FILE (or another spectral variant) -->
<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective">
    <float name="fov" value="28"/>
    <transform name="to_world">
      <lookat origin="0, -5, 2.2" target="0, 0, 0.9" up="0, 0, 1"/>
    </transform>
    <sampler type="independent">
      <integer name="sample_count" value="256"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="640"/>
      <integer name="height" value="480"/>
    </film>
  </sensor>
  <emitter type="constant">
    <spectrum name="radiance" value="0.4"/>
  </emitter>
  <shape type="sphere">
    <point name="center" x="-3" y="-4" z="6"/>
    <float name="radius" value="0.6"/>
    <emitter type="area">
      <spectrum name="radiance" value="60"/>
    </emitter>
  </shape>
  <shape type="sphere">
    <point name="center" x="0" y="0" z="1"/>
    <float name="radius" value="1"/>
    <bsdf type="measured">
      <string name="filename" value="{}"/>
    </bsdf>
  </shape>
  <shape type="rectangle">
    <transform name="to_world">
      <scale value="10"/>
    </transform>
    <bsdf type="diffuse">
      <spectrum name="reflectance" value="0.3"/>
    </bsdf>
  </shape>
</scene>
)",
                     page::escaped(bsdf_name));
}

std::string pbrt_scene(const std::string& bsdf_name, const std::string& image_name) {
  require_plain(bsdf_name);
  require_plain(image_name);
  return fmt::format(R"(# pbrt THIS_FILE (pbrt-v4)
LookAt 0 -5 2.2  0 0 0.9  0 0 1
Camera "perspective" "float fov" [ 28 ]
Sampler "zsobol" "integer pixelsamples" [ 256 ]
Integrator "volpath"
Film "rgb" "string filename" [ "{}" ]
  "integer xresolution" [ 640 ] "integer yresolution" [ 480 ]

WorldBegin
LightSource "infinite" "rgb L" [ 0.4 0.4 0.4 ]

AttributeBegin
  Translate -3 -4 6
  AreaLightSource "diffuse" "rgb L" [ 60 60 60 ]
  Shape "sphere" "float radius" [ 0.6 ]
AttributeEnd

AttributeBegin
  Translate 0 0 1
  Material "measured" "string filename" [ "{}" ]
  Shape "sphere" "float radius" [ 1 ]
AttributeEnd

AttributeBegin
  Material "diffuse" "rgb reflectance" [ 0.3 0.3 0.3 ]
  Shape "bilinearmesh" "point3 P" [ -10 -10 0  10 -10 0  -10 10 0  10 10 0 ]
AttributeEnd
)",
                     image_name, bsdf_name);
}

}  // namespace gonio::cli
