# docker build -t dse . && docker run --rm -v "$PWD:/work" dse solve problem.yaml
FROM python:3.13-slim AS build
COPY . /source
RUN python -m venv /opt/dse && /opt/dse/bin/pip install --no-cache-dir /source && rm -rf /opt/dse/bin/pip*

FROM python:3.13-slim
COPY --from=build /opt/dse /opt/dse
RUN useradd --uid 1000 --create-home dse
USER dse
WORKDIR /work
ENV PATH=/opt/dse/bin:$PATH
ENTRYPOINT ["dse"]
CMD ["--help"]
