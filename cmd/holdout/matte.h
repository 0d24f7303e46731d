// SPDX-License-Identifier: Apache-2.0
// The matte of a holdout: a layered file, or a scene rendered for it.
#pragma once

#include <memory>

#include <peeler/image_sink.h>
#include "cmd/options/capture_job.h"
#include "cmd/session/session.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

/// The fragments that hold a picture out.
class Matte {
  public:
    /// Opens `options.scene.file`. If the file is a scene, renders it with the picture's camera,
    /// samples per pixel and time. `picture` has the headers of the picture. Throws Error (kUsage)
    /// if the sizes differ, or a scene is given for a picture without a camera. Warns if cameras
    /// differ or the matte covers only a part of the picture; throws Error (kInput) instead if
    /// `reading.strict`. Otherwise throws like openInput() and GlRenderer::capture().
    Matte(const CaptureJobOptions& options, const ExrInfo& picture,
          const LayeredReadOptions& reading, Session& session);

    /// Returns the matte's fragments in a window. The result has a smaller window if a file covers
    /// only a part of the picture, and is the whole matte if a scene was rendered.
    const LayeredImage& read(const Window& window);

  private:
    void open(const ExrInfo& picture, const LayeredReadOptions& reading);
    void render(const ExrInfo& picture);

    CaptureJobOptions options_;
    Session& session_;
    std::unique_ptr<LayeredInput> input_;  ///< null if a scene was rendered
    ImageSink rendered_;
    LayeredImage band_;
};

}  // namespace peeler::cmd
