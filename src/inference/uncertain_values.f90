!> Parameters of a sample with the distributions that are given, or with estimates and covariance of a fit.
module uncertain_values
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use distributions, only: normal_quantile, quantile_within
   use failures, only: fail, failure_t, status_bad_input
   use fit_model, only: largest_name
   use hdf5_loading, only: hdf5_source_t, member_t
   use kinds, only: wp
   use number_text, only: to_text
   use scene_types, only: scene_t
   use sweep_plan, only: axis_t, plan_t
   implicit none (type, external)
   private
   public :: distribute

   !> Estimates of a fit.
   type :: estimate_t
      character(largest_name), allocatable :: names(:)
      real(wp), allocatable :: values(:)
      real(wp), allocatable :: covariance(:, :)
   end type estimate_t

   !> 95 % of the values are within so many standard deviations.
   real(wp), parameter :: half_width = 1.959963984540054_wp

contains

   !> Give the parameters of a plan, which are distributed evenly over their ranges, their own distributions. Each
   !> value keeps its share of the probability, so a Latin hypercube stays one.
   subroutine distribute(scene, plan, error)
      !> It has &uncertainty
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(inout) :: plan
      !> Set when a fit cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(estimate_t) :: estimate
      integer, allocatable :: of_fit(:)
      integer :: k

      allocate (estimate%names(0))
      if (allocated(scene%uncertainty%fit)) then
         call read_fit(scene, estimate, error)
         if (allocated(error)) return
      end if
      allocate (of_fit(size(plan%axes)))
      do k = 1, size(plan%axes)
         of_fit(k) = findloc(estimate%names, plan%axes(k)%parameter%name, dim=1)
      end do
      if (allocated(scene%uncertainty%fit) .and. all(of_fit == 0)) then
         call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit// &
            "': has none of the parameters of &sweep")
         return
      end if
      call distribute_jointly(plan, of_fit, estimate)
      if (.not. allocated(scene%uncertainty%normal)) return
      do k = 1, size(plan%axes)
         if (of_fit(k) == 0 .and. any(scene%uncertainty%normal%name == plan%axes(k)%parameter%name)) then
            call distribute_normally(plan%axes(k))
         end if
      end do
   end subroutine distribute

   !> The share of its range at which each value is.
   pure function surrogate_amplitudes(axis) result(share)
      type(axis_t), intent(in) :: axis
      real(wp) :: share(size(axis%values))

      real(wp), parameter :: nearest = 1.0e-12_wp

      if (axis%is_logarithmic) then
         share = log(axis%values/axis%minimum)/log(axis%maximum/axis%minimum)
      else
         share = (axis%values - axis%minimum)/(axis%maximum - axis%minimum)
      end if
      share = min(max(share, nearest), 1.0_wp - nearest)
   end function surrogate_amplitudes

   !> A normal distribution, or where the range is logarithmic a lognormal one, with 95 % of its values in the range;
   !> what is further than four standard deviations away, or on the other side of 0, is left out.
   subroutine distribute_normally(axis)
      type(axis_t), intent(inout) :: axis

      real(wp), parameter :: widest = 4.0_wp
      real(wp) :: deviation, maximum, minimum, mean

      associate (share => surrogate_amplitudes(axis))
         if (axis%is_logarithmic) then
            mean = 0.5_wp*log(axis%minimum*axis%maximum)
            deviation = 0.5_wp*log(axis%maximum/axis%minimum)/half_width
            axis%values = exp(quantile_within(share, mean, deviation, mean - widest*deviation, mean + widest*deviation))
         else
            mean = 0.5_wp*(axis%minimum + axis%maximum)
            deviation = 0.5_wp*(axis%maximum - axis%minimum)/half_width
            minimum = mean - widest*deviation
            maximum = mean + widest*deviation
            if (axis%minimum >= 0.0_wp) minimum = max(minimum, 0.0_wp)
            if (axis%maximum <= 0.0_wp) maximum = min(maximum, 0.0_wp)
            axis%values = quantile_within(share, mean, deviation, minimum, maximum)
         end if
      end associate
      axis%minimum = minval(axis%values)
      axis%maximum = maxval(axis%values)
   end subroutine distribute_normally

   !> Parameters of a fit: normal, correlated, within their ranges.
   subroutine distribute_jointly(plan, of_fit, estimate)
      type(plan_t), intent(inout) :: plan
      !> Place of each parameter in the fit; 0: it is not there
      integer, intent(in) :: of_fit(:)
      type(estimate_t), intent(in) :: estimate

      integer, allocatable :: axes(:)
      real(wp), allocatable :: factor(:, :), scores(:, :)
      real(wp) :: value
      integer :: i, j, k

      axes = pack([(k, k=1, size(of_fit))], of_fit > 0)
      if (size(axes) == 0) return
      allocate (scores(plan%cases, size(axes)))
      do k = 1, size(axes)
         scores(:, k) = normal_quantile(surrogate_amplitudes(plan%axes(axes(k))))
      end do
      allocate (factor(size(axes), size(axes)), source=estimate%covariance(of_fit(axes), of_fit(axes)))
      call factorise(factor)
      do k = 1, size(axes)
         associate (axis => plan%axes(axes(k)))
            do i = 1, plan%cases
               value = estimate%values(of_fit(axes(k)))
               do j = 1, k
                  value = value + factor(k, j)*scores(i, j)
               end do
               axis%values(i) = min(max(value, axis%minimum), axis%maximum)
            end do
         end associate
      end do
   end subroutine distribute_jointly

   !> The triangular factor of a covariance (Cholesky); a variance that is none by rounding counts as 0.
   pure subroutine factorise(matrix)
      !> Symmetric in; lower triangle of the factor out
      real(wp), intent(inout) :: matrix(:, :)

      integer :: i, j

      do j = 1, size(matrix, 2)
         matrix(j, j) = sqrt(max(matrix(j, j) - sum(matrix(j, :j - 1)**2), 0.0_wp))
         do i = j + 1, size(matrix, 1)
            matrix(i, j) = matrix(i, j) - sum(matrix(i, :j - 1)*matrix(j, :j - 1))
            if (matrix(j, j) > 0.0_wp) matrix(i, j) = matrix(i, j)/matrix(j, j)
            if (matrix(j, j) <= 0.0_wp) matrix(i, j) = 0.0_wp
         end do
      end do
   end subroutine factorise

   !> Read what a fit found.
   subroutine read_fit(scene, estimate, error)
      type(scene_t), intent(in) :: scene
      type(estimate_t), intent(inout) :: estimate
      !> Why it could not be read
      type(failure_t), allocatable, intent(out) :: error

      type(hdf5_source_t) :: file
      type(member_t), allocatable :: members(:)
      character(:), allocatable :: path
      integer :: last, n
      logical :: is_there

      path = scene%uncertainty%fit
      last = index(scene%file, '/', back=.true.)
      if (path(1:1) /= '/' .and. last > 0) path = beginning(scene%file, last)//path
      inquire (file=path, exist=is_there)
      if (is_there) call file%open_file(path)
      if (is_there) is_there = file%is_sound()
      if (is_there) is_there = file%has('fit')
      if (.not. is_there) then
         call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': '"//path// &
            "' is no results file of a &fit")
         return
      end if
      call file%members_of('fit', members)
      n = int(sum(members%points, mask=members%name == 'estimate'))
      deallocate (estimate%names)
      allocate (estimate%names(n), estimate%values(n), estimate%covariance(n, n))
      call file%load('fit/name', estimate%names)
      call file%load('fit/estimate', estimate%values)
      call file%load('fit/joint/covariance', estimate%covariance)
      if (.not. file%is_sound()) then
         call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': '"//path// &
            "' cannot be read")
      else if (any(ieee_is_nan(estimate%covariance))) then
         call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': parameter " &
            //to_text(findloc([(ieee_is_nan(estimate%covariance(last, last)), last=1, n)], .true., dim=1))// &
            ' of the fit has no covariance: its signal does not depend on it')
      end if
      call file%close_source()
   end subroutine read_fit

   !> The beginning of a text.
   pure function beginning(text, last) result(part)
      character(*), intent(in) :: text
      integer, intent(in) :: last
      character(:), allocatable :: part

      part = text(:last)
   end function beginning

end module uncertain_values
