// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/picture_codec.h"

#include <OpenImageIO/tiffutils.h>
#include <lcms2.h>
#include <libheif/heif.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <fstream>
#include <istream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/image/picture_outline.h"
#include "core/image/pictures_module.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// A process has one OpenImageIO, so the gate is global.
std::shared_mutex& gate() {
  static std::shared_mutex only;
  return only;
}

/// The forked thread's id differs from the one that locked the gate, so it cannot unlock it.
void open_gate_of_copy() { std::construct_at(&gate()); }

bool set_up() {
  ::pthread_atfork([] { gate().lock(); }, [] { gate().unlock(); }, open_gate_of_copy);
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);  // Only the caller's thread.
  return true;
}

std::shared_lock<std::shared_mutex> locked() {
  static const bool ready = set_up();
  static_cast<void>(ready);
  return std::shared_lock(gate());
}

}  // namespace

OpenImageIoUse::OpenImageIoUse() : lock_(locked()) {}

namespace {

/// Memory for decoders independent of the picture's size, bytes, and for each thread of a HEIF
/// decoder: a stack of 8 MB and malloc's reserve, 64 MB.
constexpr double kMemory = 1e9;
constexpr double kMemoryPerThread = 8e7;

/// Per pixel, bytes. At 4000² no decoder needs more than 15 (HEIC).
constexpr double kMemoryPerPixel = 24.0;

/// Per byte of the file: some decoders hold it whole in growing buffers.
constexpr double kMemoryPerByte = 4.0;

/// Computing time, s. At 4000² every format takes less than 0.1 µs per pixel.
constexpr double kSeconds = 20.0;
constexpr double kSecondsPerPixel = 2e-6;

/// Bytes of one piece: large enough for cheap calls, small compared to a picture.
constexpr std::size_t kPieceBytes = std::size_t{1} << 18U;

struct GridHead {
  int columns = 0;
  int rows = 0;
  float fill = 0.0F;
};

/// Reassembles pieces: the head first, then groups of rows, each preceded by its first row's
/// number.
class RowTaker {
 public:
  void take(std::string_view piece) {
    ByteReader reader(piece);
    if (image_.empty()) {
      const auto head = reader.get<GridHead>();
      image_ = Image(head.columns, head.rows, head.fill);
      return;
    }
    const auto first = static_cast<std::size_t>(reader.get<std::int32_t>());
    const std::string_view values = piece.substr(sizeof(std::int32_t));
    const auto all = image_.values();
    const std::size_t begin = first * static_cast<std::size_t>(image_.columns());
    LF_CHECK(begin + values.size() / sizeof(float) <= all.size(), std::to_string(first));
    std::memcpy(all.data() + begin, values.data(), values.size());
  }

  [[nodiscard]] Image image() && { return std::move(image_); }

 private:
  Image image_;
};

}  // namespace

ChildLimits decoder_limits(const fs::path& path, double pixels) {
  const auto bytes = static_cast<double>(fs::file_size(path));
  const double memory = kMemory + kMemoryPerThread * std::thread::hardware_concurrency() +
                        kMemoryPerPixel * pixels + kMemoryPerByte * bytes;
  return {.memory_bytes = std::min(memory, free_memory_bytes()),
          .cpu_seconds = kSeconds + kSecondsPerPixel * pixels};
}

void RowSender::begin(int columns, int rows, float fill) {
  columns_ = static_cast<std::size_t>(columns);
  ByteWriter writer;
  writer.put(GridHead{columns, rows, fill});
  send_(writer.take());
}

void RowSender::send(int first, std::span<const float> rows) {
  const std::size_t step = std::max<std::size_t>(1, kPieceBytes / sizeof(float) / columns_);
  std::string piece;
  for (std::size_t row = 0; row * columns_ < rows.size(); row += step) {
    const auto values = rows.subspan(row * columns_);
    const auto some = values.first(std::min(values.size(), step * columns_));
    const auto number = static_cast<std::int32_t>(static_cast<std::size_t>(first) + row);
    piece.assign(reinterpret_cast<const char*>(&number), sizeof number);
    piece.append(reinterpret_cast<const char*>(some.data()), some.size_bytes());
    send_(piece);
  }
}

DecodedPicture decode_in_child(
    const fs::path& path, const std::function<std::string(RowSender&, const RunControl&)>& decode,
    const RunControl& control) {
  require_regular_file(path);
  { const OpenImageIoUse set_up; }
  constexpr double kMaxPixels = double{kMaxImageSide} * kMaxImageSide;
  RowTaker taker;
  const auto work = [&](const RunControl& inner, const PieceSink& send) {
    RowSender rows(send);
    return decode(rows, inner);
  };
  const auto take = [&](std::string_view piece) { taker.take(piece); };
  try {
    std::string text =
        run_in_child("reading picture", decoder_limits(path, kMaxPixels), work, take, control);
    return {std::move(taker).image(), std::move(text)};
  } catch (const ChildFailure& failure) {
    refuse_picture(path, std::string("is no picture that can be read: its decoder ") +
                             failure.what() + "; save it as PNG");
  }
}

namespace {

/// Maximum size of a metadata chunk; printer profiles have 3 MB.
constexpr std::uint32_t kMaxBytes = 1U << 24U;

void set_profile(OIIO::ImageSpec& spec, std::string_view profile) {
  if (profile.empty()) return;
  spec.attribute("ICCProfile",
                 OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                 profile.data());
}

/// @param exif  starts with a TIFF header; some writers add JPEG's prefix.
void set_orientation(OIIO::ImageSpec& spec, std::string_view exif) {
  constexpr std::string_view kPrefix("Exif\0\0", 6);
  if (exif.starts_with(kPrefix)) exif.remove_prefix(kPrefix.size());
  OIIO::ImageSpec said;
  OIIO::decode_exif(OIIO::string_view(exif.data(), exif.size()), said);
  spec.attribute("Orientation", said.get_int_attribute("Orientation", 1));
}

std::uint32_t little_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

/// Adds "ICCProfile" and "Orientation" of a WebP file (RFC 9649, sections 2.7.1.4 and 2.7.1.5).
void add_webp_metadata(const fs::path& path, OIIO::ImageSpec& spec) {
  std::ifstream file = open_input(path);
  file.seekg(12);  // "RIFF", the length, "WEBP".
  std::string head(8, '\0');
  while (file.read(head.data(), static_cast<std::streamsize>(head.size()))) {
    const std::uint32_t size = little_endian(std::string_view(head).substr(4));
    const std::streamoff begin = file.tellg();
    const std::streamoff next = begin + size + size % 2;
    if ((head.starts_with("EXIF") || head.starts_with("ICCP")) && size <= kMaxBytes) {
      std::string data(size, '\0');
      if (!file.read(data.data(), std::streamsize{size})) return;
      if (head.starts_with("EXIF")) set_orientation(spec, data);
      if (head.starts_with("ICCP")) set_profile(spec, data);
    }
    file.seekg(next);
  }
}

/// Adds the "ICCProfile" of a HEIF file to the metadata that OpenImageIO (2.4) reads. Its
/// orientation comes from transformations, which decoders apply, not from Exif (ISO/IEC 23000-22,
/// 7.2.2).
void add_heif_metadata(const fs::path& path, OIIO::ImageSpec& spec) {
  const std::unique_ptr<heif_context, decltype(&heif_context_free)> context(heif_context_alloc(),
                                                                            heif_context_free);
  if (heif_context_read_from_file(context.get(), path.c_str(), nullptr).code != heif_error_Ok) {
    return;
  }
  heif_image_handle* first = nullptr;
  if (heif_context_get_primary_image_handle(context.get(), &first).code != heif_error_Ok) return;
  const std::unique_ptr<heif_image_handle, decltype(&heif_image_handle_release)> picture(
      first, heif_image_handle_release);
  std::string profile(
      std::min<std::size_t>(heif_image_handle_get_raw_color_profile_size(first), kMaxBytes + 1),
      '\0');
  if (profile.empty() || profile.size() > kMaxBytes) return;
  const heif_error error = heif_image_handle_get_raw_color_profile(first, profile.data());
  if (error.code == heif_error_Ok) set_profile(spec, profile);
}

/// Bytes of decoded rows held at once besides the result.
constexpr std::int64_t kBandBytes = std::int64_t{64} << 20;

/// Maximum bytes of a decoder's message, which may quote the file.
constexpr std::size_t kLongestReason = 200;

/// True if a decoder's message contains the name of a function or a type.
bool names_code(const std::string& text) {
  for (const char* mark : {"::", "()", "_", "->", "0x"}) {
    if (text.find(mark) != std::string::npos) return true;
  }
  for (std::size_t i = 1; i < text.size(); ++i) {  // "readPixels"
    if (std::islower(static_cast<unsigned char>(text[i - 1])) != 0 &&
        std::isupper(static_cast<unsigned char>(text[i])) != 0) {
      return true;
    }
  }
  return false;
}

/// ": " and the decoder's message, if it is readable.
std::string reason(const OIIO::ImageInput& input) {
  const std::string text = input.geterror();
  for (const char* lacking : {"not configured", "not implemented"}) {
    if (text.find(lacking) != std::string::npos) {
      return ": its compression cannot be read here; save it as PNG";
    }
  }
  if (text.empty() || names_code(text)) return "";
  return ": " + printable_line(text, kLongestReason);
}

/// Arguments of a format's own check of the bytes.
struct Checked {
  const fs::path& path;
  std::istream& file;
  PictureOutline& outline;
};

void set_size(const Checked& checked, std::int64_t columns, std::int64_t rows) {
  checked.outline.columns = columns;
  checked.outline.rows = rows;
  check_picture_size(checked.path, columns, rows);
}

void check_jpeg(const Checked& checked) {
  const auto jpeg = read_jpeg_outline(checked.file);
  if (!jpeg) return;
  set_size(checked, jpeg->columns, jpeg->rows);
  if (!jpeg->complete) {
    refuse_picture(checked.path, "is truncated: the JPEG data end before their end marker");
  }
}

void check_tiff(const Checked& checked) {
  const std::string problem = tiff_problem(checked.file);
  if (!problem.empty()) refuse_picture(checked.path, problem);
}

EssentialPng check_png(const Checked& checked) {
  const auto size = read_png_size(checked.file);
  if (size) set_size(checked, size->columns, size->rows);
  checked.file.clear();
  checked.file.seekg(0);
  EssentialPng png = read_essential_png(checked.file);
  if (!png.problem.empty()) refuse_picture(checked.path, png.problem);
  return png;
}

void check_pnm(const Checked& checked) {
  const PnmOutline pnm = read_pnm_outline(checked.file);
  if (!pnm.problem.empty()) refuse_picture(checked.path, pnm.problem);
  set_size(checked, pnm.columns, pnm.rows);
  const std::string problem = pnm_pixel_problem(checked.file, pnm);
  if (!problem.empty()) refuse_picture(checked.path, problem);
}

}  // namespace

PictureSource::PictureSource(const fs::path& path) : path_(path) {
  look_over();
  open();
  check_spec();
}

void PictureSource::fail(const std::string& why) const { refuse_picture(path_, why); }

void PictureSource::require_memory(double bytes) const {
  require_room({0.0, 0.0, bytes}, path_.parent_path(), path_.string(),
               "use a picture of fewer pixels");
}

void PictureSource::limit_decoder(std::int64_t columns, std::int64_t rows) const {
  const double pixels = static_cast<double>(columns) * static_cast<double>(rows);
  if (pixels > 0.0) limit_this_process(decoder_limits(path_, pixels));
}

/// @return true if the library reports success.
template <class Call>
bool PictureSource::succeeds(const Call& call) const {
  try {
    return call();
  } catch (const std::exception&) {
    fail("is corrupt, or its decoder needs more memory than the machine has");
  }
}

/// All checks that need only the bytes, before a decoder opens the file.
void PictureSource::look_over() {
  std::ifstream file = open_input(path_);
  if (file.peek() == std::ifstream::traits_type::eof()) fail("is empty");
  auto outline = read_picture_outline(file);
  if (!outline) fail(std::string("is no picture that can be read: ") + kReadableFormats + " are");
  if (!outline->problem.empty()) fail(outline->problem);
  check_picture_size(path_, outline->columns, outline->rows);
  // Decoders of these formats unpack whole pictures on opening, four bytes per pixel.
  require_memory(4.0 * static_cast<double>(outline->columns) * static_cast<double>(outline->rows));
  format_ = outline->format;
  const Checked checked{path_, file, *outline};
  if (format_ == "jpeg") check_jpeg(checked);
  if (format_ == "pnm") check_pnm(checked);
  if (format_ == "tiff") check_tiff(checked);
  if (format_ == "png") png_ = check_png(checked);
  animated_ = outline->animated || png_.animated;
  limit_decoder(outline->columns, outline->rows);
}

void PictureSource::open() {
  OIIO::ImageSpec hints;
  // Alpha is applied here, in linear light, and not by OpenImageIO to the encoded values.
  hints.attribute("oiio:UnassociatedAlpha", 1);
  // By format name: in a file name it would read settings after a '?'.
  input_ = is("bmp") ? make_bmp_input() : OIIO::ImageInput::create(format_);
  if (!input_) {
    OIIO::geterror();
    fail("is no picture that can be read: OpenImageIO was built without " + format_);
  }
  if (is("png")) {
    png_reader_ =
        std::make_unique<OIIO::Filesystem::IOMemReader>(png_.bytes.data(), png_.bytes.size());
    OIIO::Filesystem::IOProxy* const proxy = png_reader_.get();
    hints.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  }
  if (!succeeds([&] { return input_->open(path_.string(), spec_, hints); })) {
    fail("is no picture that can be read" + reason(*input_));
  }
  if (is("webp")) add_webp_metadata(path_, spec_);
  if (is("heif")) add_heif_metadata(path_, spec_);
}

void PictureSource::check_spec() const {
  check_picture_size(path_, spec_.width, spec_.height);
  if (spec_.width < 1 || spec_.height < 1 || spec_.depth > 1 || spec_.nchannels < 1) {
    fail("holds no flat picture");
  }
  if (spec_.deep) fail("holds deep pixels: only flat pictures are read");
  const auto pixels = static_cast<double>(spec_.image_pixels());
  const double row = 4.0 * spec_.width * spec_.nchannels;  // All channels as float.
  require_memory(4.0 * pixels + row * band_rows());
  limit_decoder(spec_.width, spec_.height);
}

std::string PictureSource::color_profile() const {
  const OIIO::ParamValue* const profile = spec_.find_attribute("ICCProfile");
  // libpng omits a broken profile of a PNG file.
  if (profile == nullptr) return png_.color_profile;
  return {static_cast<const char*>(profile->data()), profile->type().size()};
}

bool PictureSource::has_more_pictures() {
  const bool more = succeeds([&] { return input_->seek_subimage(1, 0); });
  input_->geterror();
  return more;
}

int PictureSource::band_rows() const {
  const std::int64_t row_bytes = std::int64_t{spec_.width} * spec_.nchannels * 4;
  const int unit = std::max(1, spec_.tile_height);
  const auto units = std::max<std::int64_t>(1, kBandBytes / (row_bytes * unit));
  return static_cast<int>(
      std::min<std::int64_t>(units * unit, std::int64_t{spec_.height} + unit - 1));
}

void PictureSource::read_rows(int begin, int end, std::vector<float>& rows) {
  rows.resize(static_cast<std::size_t>(end - begin) * static_cast<std::size_t>(spec_.width) *
              static_cast<std::size_t>(spec_.nchannels));
  const int top = spec_.y + begin;
  const int bottom = spec_.y + end;
  const bool read = succeeds([&] {
    return spec_.tile_width > 0
               ? input_->read_tiles(0, 0, spec_.x, spec_.x + spec_.width, top, bottom, spec_.z,
                                    spec_.z + 1, 0, spec_.nchannels, OIIO::TypeFloat, rows.data())
               : input_->read_scanlines(0, 0, top, bottom, spec_.z, 0, spec_.nchannels,
                                        OIIO::TypeFloat, rows.data());
  });
  // Some decoders report success despite a damaged file.
  if (!read || input_->has_error()) {
    fail("is truncated or corrupt" + reason(*input_));
  }
}

namespace {

/// Rows encoded between two checks for a stop request; EXR packs 16 at a time.
constexpr int kRowsAtOnce = 64;

void write_rows(OIIO::ImageOutput& output, const OIIO::ImageSpec& spec, const EncodedRows& rows,
                const std::string& what, const RunControl& control) {
  for (int first = 0; first < spec.height; first += kRowsAtOnce) {
    if (control.stop_requested()) throw Interrupted();
    control.report({"picture file", double{1} * first, double{1} * spec.height, ""});
    const int end = std::min(first + kRowsAtOnce, spec.height);
    const auto* const values = rows(first, end);
    const OpenImageIoUse use;
    if (output.write_scanlines(first, end, 0, spec.format, values)) continue;
    throw RunError(what + ": cannot be written: " + output.geterror());
  }
}

std::unique_ptr<OIIO::ImageOutput> create_output(const std::string& name,
                                                 OIIO::Filesystem::IOVecOutput& memory,
                                                 const std::string& what) {
  const OpenImageIoUse use;
  auto output = OIIO::ImageOutput::create(name, &memory);
  if (!output) throw RunError(what + ": cannot be written: " + OIIO::geterror());
  return output;
}

}  // namespace

std::vector<unsigned char> encode_rows(const std::string& what, OIIO::ImageSpec spec,
                                       const std::string& extension, const EncodedRows& rows,
                                       const RunControl& control) {
  spec.attribute("Software", program_mark());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::string name = "picture" + extension;
  const std::unique_ptr<OIIO::ImageOutput> output = create_output(name, memory, what);
  const auto require = [&](const auto& call) {
    const OpenImageIoUse use;
    if (!call()) throw RunError(what + ": cannot be written: " + output->geterror());
  };
  require([&] { return output->open(name, spec); });
  write_rows(*output, spec, rows, what, control);
  require([&] { return output->close(); });
  return bytes;
}

namespace {

using Bytes = std::span<const unsigned char>;
using Handle = std::unique_ptr<void, decltype(&cmsCloseProfile)>;

/// Largest difference from sRGB, display-encoded. Half a step of eight bits: common sRGB profiles
/// differ by a tenth of it, a gamma of 2.2 by fifteen times as much.
constexpr double kSameAsSrgb = 0.5 / 255.0;

Handle opened(Bytes bytes) {
  return {cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())),
          cmsCloseProfile};
}

/// Linear light with Rec. 709 primaries, as in the rest of the program.
Handle linear_rec709() {
  const cmsCIExyY white{0.3127, 0.3290, 1.0};
  const cmsCIExyYTRIPLE primaries{{0.64, 0.33, 1.0}, {0.30, 0.60, 1.0}, {0.15, 0.06, 1.0}};
  const std::unique_ptr<cmsToneCurve, decltype(&cmsFreeToneCurve)> linear(
      cmsBuildGamma(nullptr, 1.0), cmsFreeToneCurve);
  const std::array<cmsToneCurve*, 3> curves{linear.get(), linear.get(), linear.get()};
  return {cmsCreateRGBProfile(&white, &primaries, curves.data()), cmsCloseProfile};
}

}  // namespace

struct ColorProfile::Transform {
  std::unique_ptr<void, decltype(&cmsDeleteTransform)> transform{nullptr, cmsDeleteTransform};
  bool is_grey = false;
  bool has_curves = false;  ///< Curves and primaries: the channels' light adds up.
};

ColorProfile::ColorProfile(std::shared_ptr<const Transform> transform, KeptLight kept)
    : transform_(std::move(transform)), kept_(kept) {
  white_ = computed({1.0, 1.0, 1.0});
}

std::optional<ColorProfile> ColorProfile::open(Bytes bytes, KeptLight kept) {
  const Handle profile = opened(bytes);
  if (!profile) return std::nullopt;
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  if (space != cmsSigGrayData && space != cmsSigRgbData) return std::nullopt;
  const Handle light = linear_rec709();
  auto made = std::make_shared<Transform>();
  made->is_grey = space == cmsSigGrayData;
  made->has_curves = cmsIsMatrixShaper(profile.get()) != 0;
  made->transform.reset(cmsCreateTransform(
      profile.get(), made->is_grey ? TYPE_GRAY_DBL : TYPE_RGB_DBL, light.get(), TYPE_RGB_DBL,
      INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE | cmsFLAGS_NOCACHE));
  if (!made->transform) return std::nullopt;
  ColorProfile result(std::move(made), kept);
  if (!(std::isfinite(result.white_) && result.white_ > 0.0)) return std::nullopt;
  return result;
}

std::string ColorProfile::colors_of(Bytes bytes) {
  const Handle profile = opened(bytes);
  if (!profile) return {};
  switch (cmsGetColorSpace(profile.get())) {
    case cmsSigGrayData:
      return "grey";
    case cmsSigRgbData:
      return "RGB";
    case cmsSigCmykData:
      return "CMYK";
    default:
      return "other";
  }
}

std::string ColorProfile::name_of(Bytes bytes) {
  const Handle profile = opened(bytes);
  std::array<char, 256> name{};
  if (!profile || cmsGetProfileInfoASCII(profile.get(), cmsInfoDescription, "en", "US", name.data(),
                                         name.size()) == 0) {
    return {};
  }
  name.back() = '\0';
  return name.data();
}

double ColorProfile::computed(const std::array<double, 3>& stored) const {
  std::array<double, 3> rgb{};
  cmsDoTransform(transform_->transform.get(), stored.data(), rgb.data(), 1);
  return kept_ == KeptLight::kAll ? luminance_rec709(rgb) : grey_light(rgb, kept_);
}

void ColorProfile::tabulate(int most) {
  if (!transform_->has_curves) return;
  const double dark = computed({0.0, 0.0, 0.0});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::vector<double>& table = tables_[channel];
    table.resize(static_cast<std::size_t>(most) + 1);
    for (std::size_t i = 0; i < table.size(); ++i) {
      std::array<double, 3> alone{};
      alone[channel] = static_cast<double>(i) / most;
      table[i] = computed(alone) - dark * 2.0 / 3.0;
    }
  }
}

double ColorProfile::light(const std::array<double, 3>& stored) const {
  double light = 0.0;
  if (tables_[0].empty()) {
    light = computed(stored);
  } else {
    for (std::size_t c = 0; c < 3; ++c) {
      const double most = static_cast<double>(tables_[c].size() - 1);
      const double place = std::round(std::clamp(stored[c], 0.0, 1.0) * most);
      light += tables_[c][static_cast<std::size_t>(place)];
    }
  }
  return std::max(0.0, light / white_);
}

bool ColorProfile::is_srgb() const {
  constexpr int kSamples = 64;
  const auto differs = [](double light, double expected) {
    return std::abs(encode(light) - encode(expected)) > kSameAsSrgb;
  };
  for (int i = 0; i <= kSamples; ++i) {
    const double value = double{1} * i / kSamples;
    if (differs(light({value, value, value}), decode(value))) return false;
    for (std::size_t c = 0; c < 3 && !transform_->is_grey; ++c) {
      std::array<double, 3> alone{};
      alone[c] = value;
      std::array<double, 3> linear{};
      linear[c] = decode(value);
      if (differs(light(alone), grey_light(linear, kept_))) return false;
    }
  }
  return true;
}

std::vector<float> pictures_module::color_differences(std::span<const float> a,
                                                      std::span<const float> b) {
  constexpr cmsCIEXYZ kWhite{0.95047, 1.0, 1.08883};  // D65
  const auto lab_at = [&](std::span<const float> xyz, std::size_t i) {
    const cmsCIEXYZ color{static_cast<double>(xyz[i]), static_cast<double>(xyz[i + 1]),
                          static_cast<double>(xyz[i + 2])};
    cmsCIELab lab{};
    cmsXYZ2Lab(&kWhite, &lab, &color);
    return lab;
  };
  std::vector<float> differences;
  differences.reserve(a.size() / 3);
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const cmsCIELab first = lab_at(a, i);
    const cmsCIELab second = lab_at(b, i);
    differences.push_back(static_cast<float>(cmsCIE2000DeltaE(&first, &second, 1.0, 1.0, 1.0)));
  }
  return differences;
}

}  // namespace lensforge
