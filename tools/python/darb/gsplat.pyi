from typing import Any, Dict, Optional, Tuple

import torch

from . import DeviceLike, KernelLike

Tensor = torch.Tensor

def rasterization(means: Tensor, quats: Tensor, scales: Tensor, opacities: Tensor, colors: Tensor,
                  viewmats: Tensor, Ks: Tensor, width: int, height: int, near_plane: float = 0.01,
                  far_plane: float = 1e10, radius_clip: float = 0.0, eps2d: float = 0.3,
                  sh_degree: Optional[int] = None, packed: bool = True, tile_size: int = 16,
                  backgrounds: Optional[Tensor] = None, render_mode: str = "RGB",
                  sparse_grad: bool = False, absgrad: bool = False, rasterize_mode: str = "classic",
                  channel_chunk: int = 32, distributed: bool = False, camera_model: str = "pinhole",
                  segmented: bool = False, covars: Optional[Tensor] = None, with_ut: bool = False,
                  with_eval3d: bool = False, radial_coeffs: Optional[Tensor] = None,
                  tangential_coeffs: Optional[Tensor] = None,
                  thin_prism_coeffs: Optional[Tensor] = None, ftheta_coeffs: Any = None,
                  rolling_shutter: Any = None, viewmats_rs: Optional[Tensor] = None, *,
                  kernel: Optional[KernelLike] = None, footprint: Optional[str] = None,
                  accuracy: str = "balanced",
                  device: DeviceLike = "") -> Tuple[Tensor, Tensor, Dict[str, Any]]: ...
