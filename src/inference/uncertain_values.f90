!> Distributions of uncertain parameters: uniform, normal, lognormal, or joint normal with the estimates and the
!> covariance of a fit.
module uncertain_values
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use distributions, only: normal_quantile, quantile_within
   use failures, only: fail, failure_t, status_bad_input
   use file_system, only: path_beside
   use fit_model, only: max_name_length
   use hdf5_loading, only: hdf5_source_t, member_t
   use kinds, only: wp
   use number_text, only: to_text
   use quantities, only: units_in
   use reader_units, only: scene_unit_of
   use scene_types, only: scene_t
   use sweep_plan, only: axis_t, fraction_at_value, plan_t
   implicit none (type, external)
   private
   public :: distribute

   !> Estimates of a fit, and their covariance.
   type :: estimate_t
      !> Names of the fitted parameters, [parameters]
      character(max_name_length), allocatable :: names(:)
      !> Unit of each parameter; '1': none, [parameters]
      character(max_name_length), allocatable :: units(:)
      !> Estimates of the parameters, [parameters]
      real(wp), allocatable :: values(:)
      !> Covariance of the estimates, [parameters, parameters]
      real(wp), allocatable :: covariance(:, :)
   end type estimate_t

   !> Half width of a 95 % interval in standard deviations.
   real(wp), parameter :: half_width = 1.959963984540054_wp

contains

   !> Transform the parameters of a plan, which are uniformly distributed over their ranges, to their own distributions.
   !> Each value keeps its cumulative probability, so that a Latin hypercube remains one.
   subroutine distribute(scene, plan, error)
      !> Scene with &uncertainty
      type(scene_t), intent(in) :: scene
      type(plan_t), intent(inout) :: plan
      !> Set if the results of a fit cannot be read
      type(failure_t), allocatable, intent(out) :: error

      type(estimate_t) :: estimate
      character(:), allocatable :: unit
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
      do k = 1, size(of_fit)
         if (of_fit(k) == 0) cycle
         associate (j => of_fit(k))
            if (ieee_is_nan(estimate%covariance(j, j))) then
               call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': "// &
                  trim(estimate%names(j))//' has no covariance: the signal of the fit does not depend on it')
               return
            end if
            unit = scene_unit_of(units_in(scene), plan%axes(k)%parameter%quantity)
            if (unit == '') unit = '1'
            if (estimate%units(j) == unit) cycle
            call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': "// &
               trim(estimate%names(j))//" has the unit '"//trim(estimate%units(j))//"' there and '"//unit//"' here: " &
               //'both scenes need the same units')
            return
         end associate
      end do
      call distribute_jointly(plan, of_fit, estimate)
      if (.not. allocated(scene%uncertainty%normal)) return
      do k = 1, size(plan%axes)
         if (of_fit(k) == 0 .and. any(scene%uncertainty%normal%name == plan%axes(k)%parameter%name)) then
            call distribute_normally(plan%axes(k))
         end if
      end do
   end subroutine distribute

   !> Cumulative probability of each value in the uniform distribution over the range.
   pure function cumulative_probabilities(axis) result(probability)
      type(axis_t), intent(in) :: axis
      real(wp) :: probability(size(axis%values))

      ! minimum distance from the probabilities 0 and 1, whose normal quantiles are infinite
      real(wp), parameter :: min_distance = 1.0e-12_wp

      probability = fraction_at_value(axis%minimum, axis%maximum, axis%is_logarithmic, axis%values)
      probability = min(max(probability, min_distance), 1.0_wp - min_distance)
   end function cumulative_probabilities

   !> Distribute a parameter normally (lognormally if its range is logarithmic) with 95 % of the values in the range.
   !> The distribution is truncated at four standard deviations, at the values that scenes may give, and at 0 if the
   !> range is on one side of 0.
   subroutine distribute_normally(axis)
      type(axis_t), intent(inout) :: axis

      real(wp), parameter :: max_deviations = 4.0_wp
      real(wp) :: deviation, maximum, minimum, mean

      associate (probability => cumulative_probabilities(axis), allowed => axis%parameter%allowed)
         if (axis%is_logarithmic) then
            axis%distribution = 'lognormal'
            mean = 0.5_wp*log(axis%minimum*axis%maximum)
            deviation = 0.5_wp*log(axis%maximum/axis%minimum)/half_width
            minimum = mean - max_deviations*deviation
            if (allowed(1) > 0.0_wp) minimum = max(minimum, log(allowed(1)))
            maximum = min(mean + max_deviations*deviation, log(allowed(2)))
            axis%values = exp(quantile_within(probability, mean, deviation, minimum, maximum))
         else
            axis%distribution = 'normal'
            mean = 0.5_wp*(axis%minimum + axis%maximum)
            deviation = 0.5_wp*(axis%maximum - axis%minimum)/half_width
            minimum = max(mean - max_deviations*deviation, allowed(1))
            maximum = min(mean + max_deviations*deviation, allowed(2))
            if (axis%minimum >= 0.0_wp) minimum = max(minimum, 0.0_wp)
            if (axis%maximum <= 0.0_wp) maximum = min(maximum, 0.0_wp)
            axis%values = quantile_within(probability, mean, deviation, minimum, maximum)
         end if
      end associate
      axis%distribution = trim(axis%distribution)//', 95 % there'
   end subroutine distribute_normally

   !> Distribute the parameters of a fit: jointly normal with their covariance. Values beyond a range are set to its
   !> minimum or maximum.
   subroutine distribute_jointly(plan, of_fit, estimate)
      type(plan_t), intent(inout) :: plan
      !> Index of each parameter in the fit; 0: the fit does not have it
      integer, intent(in) :: of_fit(:)
      type(estimate_t), intent(in) :: estimate

      integer, allocatable :: axes(:)
      ! Cholesky factor of the covariance
      real(wp), allocatable :: factor(:, :)
      ! numbers from the standard normal distribution, [cases, parameters of the fit]
      real(wp), allocatable :: scores(:, :)
      real(wp) :: value
      ! number of cases that are set to an end of the range
      integer :: at_an_end
      integer :: i, j, k

      axes = pack([(k, k=1, size(of_fit))], of_fit > 0)
      if (size(axes) == 0) return
      allocate (scores(plan%cases, size(axes)))
      do k = 1, size(axes)
         scores(:, k) = normal_quantile(cumulative_probabilities(plan%axes(axes(k))))
      end do
      allocate (factor(size(axes), size(axes)), source=estimate%covariance(of_fit(axes), of_fit(axes)))
      call factorise(factor)
      do k = 1, size(axes)
         associate (axis => plan%axes(axes(k)))
            at_an_end = 0
            do i = 1, plan%cases
               value = estimate%values(of_fit(axes(k)))
               do j = 1, k
                  value = value + factor(k, j)*scores(i, j)
               end do
               axis%values(i) = min(max(value, axis%minimum), axis%maximum)
               if (value < axis%minimum .or. value > axis%maximum) at_an_end = at_an_end + 1
            end do
            axis%distribution = 'normal, as fitted'
            if (at_an_end > 0) axis%distribution = trim(axis%distribution)//', '//to_text(at_an_end)//' at an end'
         end associate
      end do
   end subroutine distribute_jointly

   !> Cholesky factor of a covariance; a variance that is negative by rounding counts as 0.
   pure subroutine factorise(matrix)
      !> On entry covariance; on return lower triangular factor
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

   !> Read the estimates of a fit from its results file.
   subroutine read_fit(scene, estimate, error)
      type(scene_t), intent(in) :: scene
      type(estimate_t), intent(inout) :: estimate
      !> Set if the file cannot be read or has no fit
      type(failure_t), allocatable, intent(out) :: error

      type(hdf5_source_t) :: file
      type(member_t), allocatable :: members(:)
      character(:), allocatable :: path
      integer :: n
      logical :: is_there

      path = path_beside(scene%file, scene%uncertainty%fit)
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
      allocate (estimate%names(n), estimate%units(n), estimate%values(n), estimate%covariance(n, n))
      call file%load('fit/name', estimate%names)
      call file%load('fit/unit', estimate%units)
      call file%load('fit/estimate', estimate%values)
      call file%load('fit/joint/covariance', estimate%covariance)
      if (.not. file%is_sound()) then
         call fail(error, status_bad_input, "&uncertainty fit = '"//scene%uncertainty%fit//"': '"//path// &
            "' cannot be read")
      end if
      call file%close_source()
   end subroutine read_fit

end module uncertain_values
