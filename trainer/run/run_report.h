// SPDX-License-Identifier: MIT
// The report of a training run: one HTML file without outside resources, with curves, times per
// pass, settings and held-out pictures. Readable on bright and dark screens and in print.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/data/metrics.h"
#include "trainer/step/trainer.h"

namespace darb {

struct ReportSample {  // a point of the training curves, averaged or not
    int iteration = 0;
    double seconds = 0;  // training time
    double loss = 0;
    double psnr_db = 0;  // mean over the training batch
    std::uint32_t splats = 0;
    std::vector<double> pass_ms = {};  // per iteration, by ReportData::passes; may be empty
};

struct ReportEvaluation {  // means over the held-out views
    int iteration = 0;
    double seconds = 0;
    double psnr_db = 0;
    double ssim = 0;
    std::uint32_t splats = 0;
};

struct ReportArc {  // means over an arc that was held out beside other views
    int iteration = 0;
    double psnr_db = 0, ssim = 0;
    std::uint32_t views = 0;
};

struct ReportPass {
    std::string name;
    double ms = 0;                   // per iteration
    std::optional<double> roofline;  // share of what the device can do, 0 to 1
};

struct ReportPicture {
    std::string name;            // the view's name
    std::filesystem::path file;  // PNG: photo, render and error side by side, equal widths
    double psnr_db = 0, ssim = 0;
};

struct ReportData {
    std::string title;                          // data set or output folder
    std::string device;                         // name and driver
    std::vector<ReportSample> samples;          // by iteration, ascending
    std::vector<ReportEvaluation> evaluations;  // by iteration, ascending
    std::vector<ReportArc> arcs;                // likewise
    std::vector<ReportPass> passes;             // in the order they run
    std::vector<std::pair<std::string, std::string>> settings;
    std::vector<ReportPicture> pictures;
    std::string error_caption = "error x 4";  // caption of the third part
    std::vector<std::string> notes;           // a sentence each
};

/// The whole page. Every list may be empty; its part is then left out. Values that are not finite
/// leave a gap in a curve and a dash in a table. Throws Error where a picture cannot be read.
std::string report_html(const ReportData& data);

/// report_html to a file, through write_file_atomic.
void write_report(const std::filesystem::path& path, const ReportData& data);

// Held-out views: their metrics, and their pictures beside the photos.

struct ArcMeans {  // over the views of an arc that was held out
    std::size_t views = 0;
    double psnr_db = 0, ssim = 0;
};

struct Evaluation {
    int iteration = 0;
    double seconds = 0;  // training time, without evaluations
    std::uint32_t splats = 0;
    std::vector<ViewMetrics> views;
    double psnr_db = 0, ssim = 0;  // means over the views; but for an arc, where others are there
    std::optional<ArcMeans> arc;   // where others are there
    std::optional<DepthError> depth;  // means over the views that have one
    std::optional<double> flip;       // mean over the views that have it; but for an arc, as above
};

/// Means of the views, those of an arc apart where others are there, too; but for views that are
/// masked throughout: NaN where all are.
void take_means(Evaluation& evaluation);

/// Only views, means: iteration, seconds and splats are the caller's. photos: all views' in order.
/// render: draws another scene, RGB not clamped, in place of the trainer's.
Evaluation evaluate_held_out(Trainer& trainer, const Dataset& dataset,
                             const std::vector<ImageU8>& photos,
                             const std::function<ImageF(const Camera&)>& render = {});

/// photo | render | absolute error x 4, a PNG a held-out view, in the order of the views.
std::vector<std::filesystem::path> write_side_by_side(Trainer& trainer, const Dataset& dataset,
                                                      const std::vector<ImageU8>& photos,
                                                      const std::filesystem::path& folder);

}  // namespace darb
