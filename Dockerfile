# sixbar-crossval as an unprivileged user.
FROM python:3.12-slim
# libgl1: Exudyn's wheel is linked with it.
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends libgl1 \
 && rm -rf /var/lib/apt/lists/*
COPY . /opt/sixbar
RUN python -m pip install --no-cache-dir -c /opt/sixbar/constraints.txt /opt/sixbar \
 && useradd --create-home sixbar \
 && install --directory --owner=sixbar /press
USER sixbar
WORKDIR /press
ENTRYPOINT ["sixbar"]
CMD ["validate"]
