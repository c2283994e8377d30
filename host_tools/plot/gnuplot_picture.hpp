#pragma once
// How a script becomes a picture: gnuplot is started, fed, and what it drew is put in its place.

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace kmax::plot {

/// gnuplot is missing or failed, or the file cannot be written; the message says which.
class FigureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The name given for a picture cannot be one: its ending, or a folder that does not exist.
class PictureNameError : public FigureError {
 public:
  using FigureError::FigureError;
};

struct PictureSize {
  std::size_t width, height;  ///< pixels; of an SVG points
};

/// Throws PictureNameError for what cannot be a picture's name: before anybody waits for the picture.
void require_picture_name(const std::filesystem::path& path);

/// A text of a gnuplot script that is nothing but text, whoever wrote it. A line break becomes a space.
std::string quoted(const std::string& text);

/// Draws what `script` says, its terminal and its output excepted, into an SVG or a PNG, by the file's
/// ending. The folder must exist. About 0.1 s. Throws FigureError, PictureNameError; a picture appears whole
/// or not at all.
void draw_picture(const std::string& script, PictureSize size, const std::filesystem::path& path);

}  // namespace kmax::plot
