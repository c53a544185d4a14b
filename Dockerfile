# Polyfield: one image for the server and for workers.
#
#   docker build -t polyfield .
#   docker run --init -p 8000:8000 -v polyfield-data:/data polyfield                    server with one worker
#   docker run --init -v polyfield-data:/data polyfield worker --data /data --id two    one more worker, same machine
#
# TORCH_INDEX is the package index to take PyTorch from. Its project publishes one of CPU wheels and one for each CUDA
# version: give the former for the smallest image, one of the latter for GPUs (then run with `--gpus all`; the wheels
# bring CUDA with them, the machine needs only the driver). Empty means pip's own index, whose wheel runs on the CPU too.
ARG PYTHON=3.11
ARG NODE=22

FROM node:${NODE}-slim AS viewer
WORKDIR /viewer
COPY viewer_static/package.json viewer_static/package-lock.json viewer_static/.npmrc ./
RUN npm ci --omit=dev

FROM python:${PYTHON}-slim AS packages
ARG TORCH_INDEX=""
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
RUN python -m venv /opt/polyfield
ENV PATH=/opt/polyfield/bin:$PATH
WORKDIR /app
COPY pyproject.toml README.md constraints.txt ./
# The packages' layer depends on these files only, so that a change of the sources rebuilds in seconds.
RUN mkdir -p core exporters service \
    && if [ -n "$TORCH_INDEX" ]; then \
         pip install --no-deps --index-url "$TORCH_INDEX" --constraint constraints.txt torch; \
       fi \
    && pip install --constraint constraints.txt . \
    && pip uninstall --yes polyfield

FROM python:${PYTHON}-slim
RUN useradd --uid 10001 --create-home --home-dir /home/polyfield polyfield \
    && install --directory --owner polyfield /data
COPY --from=packages /opt/polyfield /opt/polyfield
WORKDIR /app
COPY core core
COPY exporters exporters
COPY service service
COPY viewer_static viewer_static
COPY --from=viewer /viewer/node_modules viewer_static/node_modules
ENV PATH=/opt/polyfield/bin:$PATH \
    PYTHONPATH=/app \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    WARP_CACHE_PATH=/data/warp-cache \
    NVIDIA_DRIVER_CAPABILITIES=compute,utility
USER polyfield
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/health', timeout=4)"]
ENTRYPOINT ["python", "-m", "service.cli"]
CMD ["serve", "--host", "0.0.0.0", "--port", "8000", "--data", "/data"]
