!> Physical quantities: one table entry for each, with its units and the factor that converts a dimensionless value
!> ("ratio") to a value in units. Datasets, tables, names in scene files that take units, and sweeps over these names
!> follow from this table. Besides the table: the units of the results of a scene.
module quantities
   use kinds, only: lambda1_power4, pi, wp
   use scene_types, only: scales_t, output_dimensionless, output_scene, scene_t
   implicit none (type, external)
   private
   public :: quantity_table, quantity_named, system_names, system_none, units_t, units_of, ratio_of, &
      is_of_displacement, unit_of, name_in_results, words_in, are_physical, units_in

   !> Systems of units, as named in scene files: SI; millimetre, tonne and second; 'none' stands for any consistent
   !> units, of which only the dimensions are known.
   character(*), parameter :: system_names(3) = [character(8) :: 'SI', 'mm_t_s', 'none']
   integer, parameter :: system_none = size(system_names)

   ! The following constants are scales; the dimensionless unit of each quantity is a product of powers of one to three
   ! scales. Scales without a comment are components of `scales_t`.
   !> No scale: the factor 1.
   integer, parameter :: none = 1
   integer, parameter :: length = 2
   integer, parameter :: omega1 = 3
   integer, parameter :: displacement = 4
   !> Scale D omega1 of velocities.
   integer, parameter :: velocity = 5
   !> Scale D/L of slopes.
   integer, parameter :: slope = 6
   !> Scale rho Abar L of masses.
   integer, parameter :: mass = 7
   !> Scale lambda1^4 E Ibar D / (hbar L^2) of the contact force Pbar
   integer, parameter :: force = 8
   !> Scale 3 E Ibar / L^3 of stiffnesses.
   integer, parameter :: stiffness = 9
   !> Scale 3 E Ibar D / L^3 of loads.
   integer, parameter :: load = 10
   integer, parameter :: youngs_modulus = 11
   !> Scale of the bending moment, that of Pbar times L
   integer, parameter :: moment = 12
   integer, parameter :: scale_count = moment

   !> A physical quantity.
   type :: quantity_t
      character(24) :: name
      !> Symbol of the dimensionless value, printed as its unit
      character(8) :: symbol
      !> Unit in each of the systems of units
      character(18) :: unit(size(system_names))
      !> One dimensionless unit is `first**power * second**second_power * third / constant`, where `first`, `second` and
      !> `third` are scales
      integer :: first = none
      integer :: power = 1
      integer :: second = none
      integer :: second_power = 1
      real(wp) :: constant = 1.0_wp
      integer :: third = none
   end type quantity_t

   !> All quantities.
   type(quantity_t), parameter :: quantity_table(*) = [ &
      quantity_t('number', '1', [character(18) :: '1', '1', '1']), &
      quantity_t('time', 'tau', [character(18) :: 's', 's', 'time'], omega1, -1), &
      quantity_t('frequency', 'omega', [character(18) :: 'Hz', 'Hz', '1/time'], omega1, 1, &
      constant=2.0_wp*pi), &
      quantity_t('rate', '1/tau', [character(18) :: '1/s', '1/s', '1/time'], omega1, 1), &
      quantity_t('stiffness_damping', 'zeta', [character(18) :: 's', 's', 'time'], omega1, -1, constant=0.5_wp), &
      quantity_t('mass_damping', 'zeta', [character(18) :: '1/s', '1/s', '1/time'], omega1, 1, constant=0.5_wp), &
      quantity_t('length', 'x/L', [character(18) :: 'm', 'mm', 'length'], length), &
      quantity_t('per_length', 'L/x', [character(18) :: '1/m', '1/mm', '1/length'], length, -1), &
      quantity_t('displacement', 'eta', [character(18) :: 'm', 'mm', 'length'], displacement), &
      quantity_t('slope', 'slope', [character(18) :: 'rad', 'rad', 'rad'], slope), &
      quantity_t('velocity', 'eta/tau', [character(18) :: 'm/s', 'mm/s', 'length/time'], velocity), &
      quantity_t('slope_velocity', 'slope_t', [character(18) :: 'rad/s', 'rad/s', 'rad/time'], omega1, 1, slope), &
      quantity_t('acceleration', 'eta/tau2', [character(18) :: 'm/s^2', 'mm/s^2', 'length/time^2'], omega1, 2, &
      displacement), &
      quantity_t('mass', 'mu', [character(18) :: 'kg', 't', 'mass'], mass), &
      quantity_t('rotary_inertia', 'mu', [character(18) :: 'kg m^2', 't mm^2', 'mass length^2'], mass, 1, length, 2), &
      quantity_t('force', 'Pbar', [character(18) :: 'N', 'N', 'force'], force), &
      quantity_t('load', 'load', [character(18) :: 'N', 'N', 'force'], load), &
      quantity_t('line_load', 'load', [character(18) :: 'N/m', 'N/mm', 'force/length'], load, 1, length, -1), &
      quantity_t('impulse', 'impulse', [character(18) :: 'N s', 'N s', 'force time'], mass, 1, velocity), &
      quantity_t('energy', 'energy', [character(18) :: 'J', 'mJ', 'force length'], mass, 1, velocity, 2), &
      quantity_t('power', 'power', [character(18) :: 'W', 'mW', 'force length/time'], mass, 1, velocity, 2, &
      third=omega1), &
      quantity_t('moment', 'Pbar L', [character(18) :: 'N m', 'N mm', 'force length'], force, 1, length), &
      quantity_t('displacement_density', 'eta2', [character(18) :: 'm^2/Hz', 'mm^2/Hz', 'length^2 time'], &
      displacement, 2, omega1, -1, constant=0.5_wp/pi), &
      quantity_t('velocity_density', 'eta2/tau', [character(18) :: 'm^2/s^2/Hz', 'mm^2/s^2/Hz', 'length^2/time'], &
      velocity, 2, omega1, -1, constant=0.5_wp/pi), &
      quantity_t('acceleration_density', 'eta2tau3', [character(18) :: 'm^2/s^4/Hz', 'mm^2/s^4/Hz', &
      'length^2/time^3'], displacement, 2, omega1, 3, constant=0.5_wp/pi), &
      quantity_t('force_density', 'Pbar2', [character(18) :: 'N^2/Hz', 'N^2/Hz', 'force^2 time'], force, 2, omega1, &
      -1, constant=0.5_wp/pi), &
      quantity_t('moment_density', 'Pbar2 L2', [character(18) :: 'N^2 m^2/Hz', 'N^2 mm^2/Hz', 'moment^2 time'], &
      moment, 2, omega1, -1, constant=0.5_wp/pi), &
      quantity_t('stress', 'stress', [character(18) :: 'Pa', 'MPa', 'force/length^2'], youngs_modulus, 1, slope), &
      quantity_t('modulus', 'E', [character(18) :: 'Pa', 'MPa', 'force/length^2'], youngs_modulus), &
      quantity_t('density', 'rho', [character(18) :: 'kg/m^3', 't/mm^3', 'mass/length^3'], mass, 1, length, -3), &
      quantity_t('stiffness', 'kappa', [character(18) :: 'N/m', 'N/mm', 'force/length'], stiffness), &
      quantity_t('rotational_stiffness', 'kappa', [character(18) :: 'N m/rad', 'N mm/rad', 'force length'], &
      stiffness, 1, length, 2), &
      quantity_t('damper', 'c*', [character(18) :: 'N s/m', 'N s/mm', 'force time/length'], stiffness, 1, omega1, -1)]
   integer, parameter :: quantity_count = size(quantity_table)

   !> Units of results.
   type :: units_t
      !> Whether results are in the units of the scene, otherwise dimensionless
      logical :: are_physical = .false.
      !> Units of the scene: index in `system_names`
      integer :: system = system_none
      !> One dimensionless unit of each quantity, in the units of the scene; 0: not known
      real(wp) :: factor(quantity_count) = 0.0_wp
   end type units_t

contains

   !> Index of a quantity in the table; 0: no quantity has this name.
   elemental integer function quantity_named(name)
      character(*), intent(in) :: name

      ! `findloc` would copy the names at each call
      do quantity_named = quantity_count, 1, -1
         if (quantity_table(quantity_named)%name == name) return
      end do
   end function quantity_named

   !> The units of the results of a scene.
   pure type(units_t) function units_of(scales, system, are_physical) result(units)
      type(scales_t), intent(in) :: scales
      !> Index in `system_names`; 0: not given
      integer, intent(in) :: system
      !> Whether results are in the units of the scene, otherwise dimensionless
      logical, intent(in) :: are_physical

      real(wp) :: values(scale_count)
      integer :: i

      units%are_physical = are_physical
      units%system = merge(system, system_none, system > 0)
      values = scale_values(scales)
      units%factor = [(numerator(quantity_table(i), values)/denominator(quantity_table(i), values), &
         i=1, quantity_count)]
   end function units_of

   !> The dimensionless value of a quantity that is given in the units of the scene.
   elemental real(wp) function ratio_of(quantity, value, scales) result(ratio)
      !> Index of the quantity in the table
      integer, intent(in) :: quantity
      real(wp), intent(in) :: value
      type(scales_t), intent(in) :: scales

      associate (entry => quantity_table(quantity), values => scale_values(scales))
         ratio = value*denominator(entry, values)/numerator(entry, values)
      end associate
   end function ratio_of

   !> Whether the dimensionless value of a quantity depends on the unit of displacement D.
   pure logical function is_of_displacement(quantity) result(answer)
      !> Index of the quantity in the table
      integer, intent(in) :: quantity

      integer, parameter :: scales_of_displacement(6) = [displacement, velocity, slope, force, load, moment]

      answer = any(scales_of_displacement == quantity_table(quantity)%first) .or. &
         any(scales_of_displacement == quantity_table(quantity)%second)
   end function is_of_displacement

   !> Numerator of one dimensionless unit: the scales with positive powers.
   pure real(wp) function numerator(entry, values) result(product)
      type(quantity_t), intent(in) :: entry
      !> Values of the scales
      real(wp), intent(in) :: values(:)

      product = values(entry%first)**max(entry%power, 0)*values(entry%second)**max(entry%second_power, 0) &
         *values(entry%third)
   end function numerator

   !> Denominator of one dimensionless unit: the constant times the scales with negative powers.
   pure real(wp) function denominator(entry, values) result(product)
      type(quantity_t), intent(in) :: entry
      !> Values of the scales
      real(wp), intent(in) :: values(:)

      product = entry%constant*values(entry%first)**max(-entry%power, 0) &
         *values(entry%second)**max(-entry%second_power, 0)
   end function denominator

   !> Values of all scales in the units of the scene; 0: not known.
   pure function scale_values(scales) result(values)
      type(scales_t), intent(in) :: scales
      real(wp) :: values(scale_count)

      values(none) = 1.0_wp
      values(length) = scales%length
      values(omega1) = scales%omega1
      values(displacement) = scales%displacement
      values(velocity) = scales%omega1*scales%displacement
      values(slope) = scales%displacement/scales%length
      values(mass) = scales%beam_mass
      ! of the contact force Pbar
      values(force) = lambda1_power4*scales%displacement*scales%bending_stiffness &
         /(scales%height_ratio*scales%length**3)
      values(stiffness) = 3.0_wp*scales%bending_stiffness/scales%length**3
      values(load) = 3.0_wp*scales%bending_stiffness*scales%displacement/scales%length**3
      values(youngs_modulus) = scales%youngs_modulus
      values(moment) = values(force)*scales%length
   end function scale_values

   !> The unit of a quantity in results.
   pure function unit_of(quantity, units) result(unit)
      !> Index of the quantity in the table
      integer, intent(in) :: quantity
      type(units_t), intent(in) :: units
      character(:), allocatable :: unit

      unit = trim(quantity_table(quantity)%unit(units%system))
   end function unit_of

   !> The name of a dataset or a column in results with units: tau, eta and omega within the dimensionless name become
   !> time, displacement and frequency.
   pure function name_in_results(name) result(named)
      !> Name; underscores join its words
      character(*), intent(in) :: name
      character(:), allocatable :: named

      ! symbols in names, and the words that replace them
      character(*), parameter :: greek(3) = [character(5) :: 'tau', 'eta', 'omega']
      character(*), parameter :: latin(3) = [character(12) :: 'time', 'displacement', 'frequency']
      integer :: i, place

      named = trim(name)
      do i = 1, size(greek)
         if (index(named, trim(greek(i))) == 0) cycle
         place = index('_'//named//'_', '_'//trim(greek(i))//'_')
         if (place > 0) named = named(:place - 1)//trim(latin(i))//named(place + len_trim(greek(i)):)
      end do
   end function name_in_results

   !> A text for results: of each {this~that} in the text, `this` remains in dimensionless results, `that` in results
   !> with units.
   pure function words_in(units, text) result(words)
      type(units_t), intent(in) :: units
      character(*), intent(in) :: text
      character(:), allocatable :: words

      integer :: opened, tilde, closed

      words = text
      do
         opened = index(words, '{')
         if (opened == 0) return
         closed = opened + index(words(opened:), '}') - 1
         tilde = opened + index(words(opened:closed)//'~', '~') - 1
         if (units%are_physical) then
            words = words(:opened - 1)//words(tilde + 1:closed - 1)//words(closed + 1:)
         else
            words = words(:opened - 1)//words(opened + 1:min(tilde, closed) - 1)//words(closed + 1:)
         end if
      end do
   end function words_in

   !> Units of the results: as the scene requests; without a request the units of the scene if it has a unit system,
   !> else no units (dimensionless results).
   pure type(units_t) function units_in(scene) result(units)
      type(scene_t), intent(in) :: scene

      units = units_of(scene%scales, scene%unit_system, are_physical(scene))
   end function units_in

   !> Whether the results of a scene are physical, that is, in its units; otherwise they are dimensionless.
   pure logical function are_physical(scene) result(answer)
      type(scene_t), intent(in) :: scene

      answer = scene%output_units == output_scene .or. (scene%output_units /= output_dimensionless &
         .and. scene%unit_system > 0 .and. scene%unit_system /= system_none)
   end function are_physical

end module quantities
