// The report of the experiments: one self-contained HTML page with tables, plots, pictures and verdicts, each
// with the command that makes it alone. Readable on paper, on a phone, and by people who do not see all
// colours.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/paper/verdicts/verdicts.hpp"
#include "pade/report/tables/result_table.hpp"

namespace pade::evaluation {

/// Its name is not shown; title, command (where the section has it) and note may be empty.
using ReportTable = ResultTable;

/// A plot or an image. One of `svg` and `image` is given.
struct ReportPicture {
  std::string caption;
  std::string svg = {};     ///< an <svg> element, as line_plot() gives it, or other HTML; not escaped
  cv::Mat image = {};       ///< CV_8UC1 or CV_8UC3 (BGR)
  bool photograph = false;  ///< the image is kept as JPEG, else as PNG
};

/// A part of the report: what is empty is left out.
struct ReportSection {
  std::string id;       ///< for links into the page, "table1"
  std::string title;    ///< "Table 1: absolute depth error"
  std::string command;  ///< that makes this section alone: "pade experiment table1"
  std::string text;     ///< paragraphs with an empty line between them
  std::vector<ReportTable> tables = {};
  std::vector<ReportPicture> pictures = {};
  std::vector<Verdict> verdicts = {};
};

/// What a report of experiments is made of.
struct ExperimentReport {
  std::string title;
  std::string text;                                          ///< paragraphs under the title
  std::vector<std::pair<std::string, std::string>> facts;    ///< program, seeds, machine, ...
  std::vector<std::pair<std::string, std::string>> options;  ///< to make it again, at the end of the page
  std::vector<ReportSection> sections;
};

/// The page. Nothing in it but what is given: the same input gives the same bytes. Text is escaped; ids of
/// sections are made unique.
std::string to_html(const ExperimentReport& report);

}  // namespace pade::evaluation
