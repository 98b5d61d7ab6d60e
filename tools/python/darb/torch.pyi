from typing import Any, Optional, Tuple, Union

import torch

from . import DeviceLike, Info, KernelLike

Tensor = torch.Tensor

def rasterize(means: Tensor, quats: Optional[Tensor] = None, scales: Optional[Tensor] = None,
              opacities: Optional[Tensor] = None, *, colors: Optional[Tensor] = None,
              sh: Optional[Tensor] = None, shapes: Optional[Tensor] = None, viewmats: Any, Ks: Any, width: int, height: int,
              kernel: Optional[KernelLike] = None, footprint: Optional[str] = None,
              background: Union[Tensor, Any, None] = None, sh_degree: Optional[int] = None,
              antialiased: Optional[bool] = None, near: float = 0.2, accuracy: str = "balanced",
              depth: bool = False,
              device: DeviceLike = "") -> Tuple[Tensor, Tensor, Info]: ...
