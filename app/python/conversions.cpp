// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/python/conversions.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"

namespace lensforge::python {
namespace {

std::string shape_text(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>();
}

[[noreturn]] void refuse(const std::string& name, const py::array& array, const std::string& rule) {
  throw InputError(name + ": an array of shape " + shape_text(array) + " and type " +
                   py::str(array.dtype()).cast<std::string>() + "; " + rule);
}

/// @throw InputError unless `array` is rows of three numbers.
void require_triples(const std::string& name, const py::array& array, const std::string& kinds) {
  const bool known = kinds.find(array.dtype().kind()) != std::string::npos;
  if (known && array.ndim() == 2 && array.shape(1) == 3 && array.shape(0) > 0) return;
  refuse(name, array, kinds == "f" ? "must be (n, 3) floats" : "must be (n, 3) integers");
}

void require_vertex_numbers(const SurfaceMesh& mesh) {
  const auto out_of_range = [&](int v) { return v < 0 || v >= mesh.vertex_count(); };
  const auto all = mesh.triangles.reshaped();
  const auto bad = std::find_if(all.begin(), all.end(), out_of_range);
  if (bad == all.end()) return;
  throw InputError("faces: vertex number " + std::to_string(*bad) + ": must be 0 to " +
                   std::to_string(mesh.vertex_count() - 1));
}

py::array read_only(py::array array) {
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

/// The (n, 3) array whose rows are a matrix's columns.
template <class Matrix>
py::array rows_of(const Matrix& columns, const py::object& owner) {
  using Value = typename Matrix::Scalar;
  return py::array_t<Value>({static_cast<py::ssize_t>(columns.cols()), py::ssize_t{3}},
                            columns.data(), owner);
}

py::array pixels_of(const Image& image, const py::object& owner) {
  return py::array_t<float>(
      {static_cast<py::ssize_t>(image.rows()), static_cast<py::ssize_t>(image.columns())},
      image.values().data(), owner);
}

/// A Python object that owns a value, for arrays to keep alive.
template <class Value>
py::capsule owner_of(std::unique_ptr<Value> value) {
  py::capsule owner(value.get(), [](void* held) {
    const std::unique_ptr<Value> last(static_cast<Value*>(held));
  });
  static_cast<void>(value.release());
  return owner;
}

constexpr py::ssize_t kMaxChannels = 4;

/// Numbers of one type as light.
template <class Number>
class Light {
 public:
  static constexpr bool kEncoded = std::is_integral_v<Number>;
  static constexpr double kWhite = kEncoded ? double{std::numeric_limits<Number>::max()} : 1.0;

  Light() {
    if constexpr (kEncoded) {
      for (int value = 0; value <= std::numeric_limits<Number>::max(); ++value) {
        table_.push_back(decode(value / kWhite));
      }
    }
  }

  [[nodiscard]] double of(Number value) const {
    if constexpr (kEncoded) return table_[value];
    return static_cast<double>(value);
  }

 private:
  std::vector<double> table_;
};

/// The light of a pixel without its alpha. @param channels  of the pixel.
template <class Number>
double grey(const Number* pixel, int channels, const Light<Number>& light, KeptLight kept) {
  if (channels < 3) return light.of(pixel[0]);
  return grey_light({light.of(pixel[0]), light.of(pixel[1]), light.of(pixel[2])}, kept);
}

template <class Number>
void require_light(std::span<const Number> values, const std::string& name) {
  if constexpr (!std::is_integral_v<Number>) {
    const auto bad = std::find_if(values.begin(), values.end(),
                                  [](Number v) { return !(v >= 0) || !std::isfinite(v); });
    if (bad == values.end()) return;
    throw InputError(name + ": holds " + number_text(*bad) +
                     ": light must be finite and not negative");
  }
}

template <class Number>
Image image_of(const py::array& array, const std::string& name, const Background& background,
               KeptLight kept) {
  const py::array_t<Number, py::array::c_style | py::array::forcecast> numbers(array);
  const std::span<const Number> values(numbers.data(), static_cast<std::size_t>(numbers.size()));
  require_light(values, name);
  const int channels = numbers.ndim() == 2 ? 1 : static_cast<int>(numbers.shape(2));
  const bool has_alpha = channels == 2 || channels == 4;
  const double behind = background.light(kept);
  const Light<Number> light;
  bool open = false;
  Image image(static_cast<int>(numbers.shape(1)), static_cast<int>(numbers.shape(0)));
  const Number* pixel = values.data();
  for (float& value : image.values()) {
    const double whole = grey(pixel, channels, light, kept);
    const double alpha =
        has_alpha ? static_cast<double>(pixel[channels - 1]) / Light<Number>::kWhite : 1.0;
    if (alpha > 1.0) {
      throw InputError(name + ": holds an alpha of " + number_text(alpha) + ": must be 0 to 1");
    }
    open = open || alpha < 1.0;
    value = static_cast<float>(alpha * whole + (1.0 - alpha) * behind);
    pixel += channels;
  }
  // A channel may be empty where the picture is not.
  if (!open || kept != KeptLight::kAll) return image;
  if (const auto reason = hidden_by(image, background)) throw InputError(name + ": " + *reason);
  return image;
}

}  // namespace

Image image_from(const py::array& array, const std::string& name, const Background& background,
                 KeptLight kept) {
  const char kind = array.dtype().kind();
  const auto bytes = array.dtype().itemsize();
  const bool known = kind == 'f' || (kind == 'u' && bytes <= 2);
  const bool shaped = array.ndim() == 2 ||
                      (array.ndim() == 3 && array.shape(2) >= 1 && array.shape(2) <= kMaxChannels);
  if (!known || !shaped || array.size() == 0) {
    refuse(name, array,
           "must be (rows, columns), or those and 1 to 4 channels, of floats, linear light, 1 is "
           "white, or of uint8 or uint16, sRGB-encoded");
  }
  if (std::max(array.shape(0), array.shape(1)) > kMaxImageSide) {
    refuse(name, array, "sides must be at most " + std::to_string(kMaxImageSide));
  }
  if (kind == 'f') return image_of<float>(array, name, background, kept);
  return bytes == 1 ? image_of<std::uint8_t>(array, name, background, kept)
                    : image_of<std::uint16_t>(array, name, background, kept);
}

LoadedColors colors_from(const py::array& array, const std::string& name,
                         const Background& background) {
  image_from(array, name, background);  // Its checks are of all light.
  const auto channel = [&](KeptLight kept) { return image_from(array, name, background, kept); };
  return {{channel(KeptLight::kRed), channel(KeptLight::kGreen), channel(KeptLight::kBlue)}, {}};
}

SurfaceMesh mesh_from(const py::array& vertices, const py::array& faces) {
  require_triples("vertices", vertices, "f");
  require_triples("faces", faces, "iu");
  const Numbers points(vertices);
  const Indices corners(faces);
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(points.data(), 3, points.shape(0));
  mesh.triangles = Eigen::Map<const Eigen::Matrix3Xi>(corners.data(), 3, corners.shape(0));
  if (!mesh.vertices.allFinite()) throw InputError("vertices: all coordinates must be finite");
  require_vertex_numbers(mesh);
  return mesh;
}

std::vector<double> pixels_from(const py::array& array, const std::string& name,
                                const Eigen::Vector2i& pixels) {
  if (array.ndim() != 2 || array.shape(0) != pixels.y() || array.shape(1) != pixels.x()) {
    refuse(name, array,
           "must be (" + std::to_string(pixels.y()) + ", " + std::to_string(pixels.x()) +
               ") as the setup's pixels");
  }
  const Numbers values(array);
  return {values.data(), values.data() + values.size()};
}

py::array view_of(const Image& image, const py::object& owner) {
  return read_only(pixels_of(image, owner));
}

py::array view_of(const Eigen::Matrix3Xd& columns, const py::object& owner) {
  return read_only(rows_of(columns, owner));
}

py::array view_of(const Eigen::Matrix3Xi& columns, const py::object& owner) {
  return read_only(rows_of(columns, owner));
}

py::array array_of(Image&& image) {
  auto held = std::make_unique<Image>(std::move(image));
  const Image& kept = *held;
  return pixels_of(kept, owner_of(std::move(held)));
}

py::array array_of(std::vector<double>&& values, const Eigen::Vector2i& pixels) {
  auto held = std::make_unique<std::vector<double>>(std::move(values));
  const double* const data = held->data();
  return py::array_t<double>(
      {static_cast<py::ssize_t>(pixels.y()), static_cast<py::ssize_t>(pixels.x())}, data,
      owner_of(std::move(held)));
}

py::array array_of(Eigen::Matrix3Xd&& columns) {
  auto held = std::make_unique<Eigen::Matrix3Xd>(std::move(columns));
  const Eigen::Matrix3Xd& kept = *held;
  return rows_of(kept, owner_of(std::move(held)));
}

namespace {

bool is_bool(py::handle value) { return PyBool_Check(value.ptr()) != 0; }
bool is_whole(py::handle value) { return !is_bool(value) && PyIndex_Check(value.ptr()) != 0; }
bool is_number(py::handle value) {
  return is_whole(value) || PyFloat_Check(value.ptr()) != 0 ||
         py::isinstance(value, py::module_::import("numpy").attr("floating"));
}
bool is_text(py::handle value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

std::string number_word(py::handle value) {
  if (is_whole(value)) return py::str(py::int_(py::reinterpret_borrow<py::object>(value)));
  return py::repr(py::float_(py::reinterpret_borrow<py::object>(value)));
}

std::string text_word(py::handle value) {
  return py::module_::import("os").attr("fspath")(value).cast<std::string>();
}

/// "1.5,2": several numbers are one text; empty if one of them is none.
std::string list_word(py::handle values) {
  std::string text;
  for (const py::handle value : values) {
    if (!is_number(value)) return {};
    if (!text.empty()) text += ",";
    text += number_word(value);
  }
  return text;
}

/// A whole number beyond the range of doubles is infinite: it breaks every option's limits.
double number_of(py::handle value) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() == nullptr) return number;
  if (PyErr_ExceptionMatches(PyExc_OverflowError) == 0) throw py::error_already_set();
  PyErr_Clear();
  return std::numeric_limits<double>::infinity();
}

FieldValue number_value(const FieldSpec& spec, py::handle value) {
  const double number = number_of(value);
  spec.require(number_word(value), number);
  return spec.kind == FieldKind::kWhole ? FieldValue(static_cast<int>(number)) : number;
}

/// The text of a word, length or text; empty if it is none.
std::string text_of(const FieldSpec& spec, py::handle value) {
  if (is_text(value)) return spec.kind == FieldKind::kNumber ? "" : text_word(value);
  const bool list = spec.kind == FieldKind::kText && py::isinstance<py::sequence>(value);
  return list ? list_word(value) : "";
}

/// A value as its option's type; none if it is of another. @throw InputError naming option, value
/// and rule.
FieldValue value_from(const FieldSpec& spec, py::handle value) {
  if (spec.kind == FieldKind::kFlag) {
    return is_bool(value) ? FieldValue(value.cast<bool>()) : FieldValue();
  }
  if (spec.kind == FieldKind::kWhole) {
    return is_whole(value) ? number_value(spec, value) : FieldValue();
  }
  if (spec.is_number() && is_number(value)) return number_value(spec, value);
  const std::string text = text_of(spec, value);
  return text.empty() ? FieldValue() : value_of(spec, text);
}

}  // namespace

Keywords::Keywords(std::string function, const Description& fields,
                   const std::set<std::string>& withheld, Defaults defaults)
    : function_(std::move(function)) {
  app::OptionSet options(function_, "");
  options.add(fields);
  const app::CommonOptions common_defaults;
  defaults_ = {{"--threads", std::to_string(common_defaults.threads)},
               {"--device", common_defaults.device}};
  for (const Field& field : fields) {
    const bool shown = field.kind != FieldKind::kFlag && defaults == Defaults::kOwn;
    if (shown) defaults_[field.name] = value_text(field.get());
  }
  try {
    options.parse({app::kListOptions});
  } catch (const app::ListedOptions& listed) {
    specs_ = listed.options;
  }
  static const std::set<std::string> common{"--json", "--quiet",    "--config",
                                            "--help", "--help-all", "--version"};
  std::erase_if(specs_, [&](const FieldSpec& spec) {
    return !spec.name.starts_with("--") || common.contains(spec.name) ||
           withheld.contains(spec.name);
  });
}

const FieldSpec& Keywords::spec_of(const std::string& keyword) const {
  const auto found = std::find_if(specs_.begin(), specs_.end(), [&](const FieldSpec& spec) {
    return keyword_of(spec.name) == keyword;
  });
  if (found == specs_.end()) {
    throw py::type_error(function_ + "() got an unexpected keyword argument '" + keyword +
                         "'; help(lensforge." + function_ + ") lists them");
  }
  return *found;
}

app::OptionValues Keywords::values(const py::dict& given) const {
  app::OptionValues values;
  for (const auto& [key, value] : given) {
    const auto keyword = key.cast<std::string>();
    FieldSpec spec = spec_of(keyword);
    const std::string option = std::exchange(spec.name, keyword);
    const FieldValue taken = value_from(spec, value);
    if (std::holds_alternative<std::monostate>(taken)) {
      throw py::type_error(function_ + "(): " + keyword + "=" +
                           py::repr(value).cast<std::string>() + ": must be " + python_type(spec));
    }
    // A flag that is off counts as not given.
    if (taken != FieldValue(false)) values[option] = taken;
  }
  return values;
}

std::string Keywords::text() const {
  std::string text;
  for (const FieldSpec& spec : specs_) {
    const auto found = defaults_.find(spec.name);
    text += docstring_line(spec, found == defaults_.end() ? "" : found->second);
  }
  return text;
}

}  // namespace lensforge::python
